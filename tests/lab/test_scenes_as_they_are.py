"""Scenes with the settings that they recommend, against Pinocchio (4.1.0) to 1e-10: no larger error than the scene allows, and trusted.

The whole catalog takes some minutes: `python -m tests.benchmarks.scenes_as_they_are`. Here are those that are the hardest on the timestep.
"""

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.protocol import engine
from mechlab.experiment.scene import Settings
from tests.benchmarks.scenes_as_they_are import MEANT, cases

EXACT = Settings("pinocchio", "DOP853", tolerance=1e-10)


@pytest.mark.parametrize(
    ("name", "scene"),
    [
        ("cardan", "driven"), ("chebyshev", "driven-crank"), ("jansen", "driven-crank"), ("scissor_lift", "driven-crank"),
        ("upu3", "driven"), ("parallel_guide", "driven"), ("fourbar", "constant-torque"), ("hart", "free-run"), ("plagiograph", "free-run"),
        ("fivebar", "free-run"), ("palletizer", "free-run"), ("geared_fivebar", "free-run"), ("hoeken", "free-run"), ("sarrus", "free-run"),
    ],
)  # fmt: skip
def test_a_scene_as_it_is_stays_within_its_tolerance(name: str, scene: str) -> None:
    run, design = ml.simulate(name, scene=scene), ml.load(name).for_scene(scene)
    made = design.scene(scene)
    times = run.t[:: max(1, len(run.t) // 40)]
    truth = engine("pinocchio").at_times(design.mechanism(made.fidelity), made, EXACT, times)
    mine, theirs = (np.searchsorted(t, times - 1e-9) for t in (run.t, truth.t))
    assert np.allclose(truth.t[theirs], times, atol=1e-9) and run.settings.engine == "mujoco"
    assert np.max(np.abs(run.q[mine] - truth.q[theirs])) < made.tolerance
    assert run.health.trusted


def test_scenes_that_are_meant_to_fail_exist() -> None:
    assert set(cases()) >= MEANT
