"""Constant loads are put into the engine once: same motion, forces and work as through a call at every stage."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from mechlab.catalog.closed_differential.build import Parameters, build
from mechlab.catalog.closed_differential.scenes import SCENES
from mechlab.engines.mujoco.runner import run
from mechlab.engines.pinocchio.dynamics import PinPlant
from mechlab.errors import MechlabError
from mechlab.experiment.laws import AppliedForce, Constant, applied_force


@dataclass(frozen=True)
class Called(Constant):
    """A constant load that is not known to be one."""


@pytest.mark.parametrize("fidelity", ["minimal", "full"])
def test_same_run_as_through_the_callback(fidelity: str) -> None:
    m = build(Parameters(), fidelity)
    scene = replace(SCENES["constant-moments"].make(Parameters(), fidelity), duration=0.05)
    assert all(type(law) is Constant for law in scene.laws)
    called = replace(scene, laws=tuple(Called(law.on, law.value) for law in scene.laws))
    once, each = run(m, scene, scene.settings), run(m, called, scene.settings)
    assert list(once.channels) == list(each.channels)
    for name, values in once.channels.items():
        np.testing.assert_array_equal(values, each.channels[name])
    for a, b in zip(once.health.findings, each.health.findings, strict=True):
        # The work is force x way instead of a sum of force x rate: rounding.
        assert (a.name, a.severity) == (b.name, b.severity) and a.value == pytest.approx(b.value, rel=1e-9, abs=1e-14)


def test_prepared_forces_are_those_of_the_laws() -> None:
    m = build(Parameters(), "full")
    laws = SCENES["housing-drag"].make(Parameters(drag_14=0.02, drag_36=2.0), "full").laws
    plant = PinPlant(m, None, np.linspace(-3.0, 5.0, m.nv))
    total, by_name = AppliedForce(m, laws)(0.1, plant)
    expected, names = applied_force(m, laws, 0.1, plant)
    np.testing.assert_allclose(total, expected, rtol=1e-15)
    assert by_name == names


def test_a_force_that_is_not_finite_is_refused() -> None:
    scene = SCENES["constant-moments"].make(Parameters(), "minimal")
    bad = replace(scene, laws=(Constant("H1", float("nan")),))
    with pytest.raises(MechlabError, match="'H1'"):
        run(build(Parameters(), "minimal"), bad, scene.settings)
