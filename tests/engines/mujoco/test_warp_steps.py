"""Motions by MuJoCo Warp against MuJoCo itself. Skipped where the extra gpu is not installed; on its CPU device where there is no GPU.

Single precision rounds places in a mechanism of .5 m to 3e-8 m, which hard loops with the time constant 2 h, h = 1 ms, turn into rates of
3e-5 m/s, 3e-4 rad/s at a crank of .1 m, and into some 1e-6 rad. A dropped gear or the length of another motion makes more than 1e-2. The
kernels of MuJoCo Warp are compiled first, which takes a minute.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.mujoco.batch import Motions, roll
from mechlab.engines.mujoco.stepping import grid
from mechlab.errors import MechlabError
from mechlab.experiment.acting import acting
from mechlab.experiment.laws import Constant
from mechlab.experiment.scene import Scene, Settings, initial_state
from tests.mechanism.samples import fourbar, planetary

pytest.importorskip("mujoco_warp", reason="MuJoCo Warp is not installed: the extra gpu")
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]  # its own warnings are its own

from mechlab.engines.mujoco.warp_steps import steps_of_warp  # noqa: E402

STEPS = grid(0.04, 1e-3)
CLOSE, CLOSE_RATES = 1e-5, 5e-3
"""Differences allowed [rad, rad/s], ten times what is expected: see above."""


def asked(m, rates, settings=None, laws=(), drives="free") -> Motions:
    scene = acting(m, Scene("s", duration=0.04, initial_rates=rates, laws=laws, drives=drives))
    q, v = initial_state(m, scene)
    return Motions(m, scene, settings or Settings(), np.array([q, q]), np.array([v, 0.5 * v]), {})


def is_that_of_mujoco(motions: list[Motions]) -> None:
    for single, double in zip(roll(motions, STEPS, take=steps_of_warp), roll(motions, STEPS), strict=True):
        assert np.abs(single.q - double.q).max() < CLOSE and np.abs(single.v - double.v).max() < CLOSE_RATES
        assert single.q.dtype == np.float64 and not np.array_equal(single.q, double.q)  # it was another engine
        assert single.reasons == double.reasons == ("",) * len(double.reasons)


def test_loops_move_as_in_double_precision_and_so_do_models_of_other_numbers() -> None:
    is_that_of_mujoco([asked(fourbar(), {"crank": 4.0})])
    lengths = [fourbar(crank=x, coupler=0.3 + 0.1 * x) for x in (0.08, 0.1, 0.12)]
    light = replace(lengths[1], gravity=(0.0, -1.6, 0.0))
    is_that_of_mujoco([asked(m, {"crank": 4.0}) for m in (*lengths, light)])


def test_drives_that_hold_are_not_lost() -> None:
    m = ml.load("fourbar").mechanism("minimal")  # 200 N m/rad and 2 N m s/rad on its crank
    is_that_of_mujoco([asked(m, {"crank_angle": 0.5}, Settings(timestep=1e-3), drives="hold")])


def test_gears_are_not_dropped() -> None:
    """Sun and ring drive the carrier by the teeth: w_carrier (z_sun + z_ring) = z_sun w_sun + z_ring w_ring (Willis)."""
    m = planetary()
    motions = [asked(m, {"sun": 3.0, "ring": 1.0}, laws=(Constant("sun", 0.01),))]
    is_that_of_mujoco(motions)
    (found,) = roll(motions, STEPS, take=steps_of_warp)
    rate = {name: found.v[0, -1, m.v_slice[name].start] for name in ("sun", "ring", "carrier")}
    assert rate["carrier"] * (24 + 84) == pytest.approx(24 * rate["sun"] + 84 * rate["ring"], rel=1e-4)
    assert rate["sun"] > 3.01  # the load acts


def test_what_it_cannot_vary_between_motions_is_named() -> None:
    teeth = [planetary(teeth=(24, 30, 84)), planetary(teeth=(20, 32, 84))]
    with pytest.raises(MechlabError, match="no wrap_prm for each motion"):
        roll([asked(m, {"sun": 1.0, "ring": 0.5}) for m in teeth], STEPS, take=steps_of_warp)


@pytest.mark.parametrize(("key", "values"), [("start_speed", np.linspace(1.0, 3.0, 40)), ("coupler_length", np.linspace(0.8, 1.2, 40))])
def test_a_sweep_states_an_error_that_holds_at_every_point(key: str, values: np.ndarray) -> None:
    asked = ("n_fourbar", {key: values}, "B0_x,y,loop_gap")
    options = {"scene": "fall", "duration": 0.4, "timestep": 0.0025}
    single, double = ml.sweep(*asked, backend="warp", **options), ml.sweep(*asked, **options)
    assert single.request.method == double.request.method == "rollout" and single.exit_code == 0
    for label, error in single.errors.items():
        assert 0.0 < np.abs(single[label] - double[label]).max() <= error < 1e-3
    assert not double.errors and "single precision" in single.warnings[0] and "single precision" in single.text()
