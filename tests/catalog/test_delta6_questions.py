"""Questions to the delta from the command line: error and settling of the head, its dynamics, margins of the workspace."""

from __future__ import annotations

import json
from functools import reduce

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic import delta6 as closed
from mechlab.cli import main
from mechlab.errors import MechlabError

ENGINES = ("pinocchio", "mujoco")
ANGLES = ("alpha", "beta", "gamma")


def asked(capsys, *keys, code=0):
    assert main(["solve", "delta6", *keys, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def closed_form(question, **given):
    """What the closed form alone says to arrays of values."""
    design = api.load("delta6")
    found = next(q for q in design.entry.questions if q.name == question)
    complete = {k: x for k, x in found.optional.items() if x is not None} | given
    return found.witnesses["analytic"](design.parameters, complete).values


def test_error_of_the_head_at_the_printed_times(capsys):
    """Specification, check A9: e(1 s), e(3 s) with gains 240 and 480, and the command at t = 0."""
    found = closed_form("error of the head", time=np.array([1.0, 3.0]))
    printed = [[0.006484, 0.000451, 0.039921], [0.000115, 0.000008, 0.000707]]
    for k, n in enumerate(ANGLES):
        np.testing.assert_allclose(found[f"{n}_error"], np.array(printed)[:, k], rtol=0, atol=5.1e-7)
    start = asked(capsys, "time=0")["answers"]
    for witness in ("analytic", "exponential"):
        np.testing.assert_allclose([start[witness][f"{n}_command"] for n in ANGLES], [72, -202, 0], atol=1e-9)


def test_error_of_the_head_from_four_witnesses(capsys):
    said = asked(capsys, "time=50ms", "alpha_error_0=0.2", "beta_error_0=-0.1", "gamma_error_rate_0=1")["answers"]
    assert set(said) == {"analytic", "exponential", *ENGINES}
    for n in ANGLES:
        truth = said["exponential"]
        assert said["analytic"][f"{n}_error"] == pytest.approx(truth[f"{n}_error"], abs=1e-14)
        for engine in ENGINES:
            # RK4 and soft loops: below 1e-8 rad measured
            assert said[engine][f"{n}_error"] == pytest.approx(truth[f"{n}_error"], abs=1e-6)
            assert said[engine][f"{n}_error_rate"] == pytest.approx(truth[f"{n}_error_rate"], abs=1e-4)


def test_settling_of_the_head(capsys):
    """Specification 3.3: |e_gamma| < 1e-3 after 2.83 s, and 11.39 s with the gains exchanged."""
    for gains, seconds in (((), 2.83), (("velocity_gain=480", "position_gain=240"), 11.39)):
        document = asked(capsys, "settled_below=1e-3", *gains)
        for witness in ("analytic", "exponential"):
            assert document["answers"][witness]["gamma_settling_time"] == pytest.approx(seconds, abs=5.1e-3)
        assert document["max_difference"] < 1e-6


def test_settling_of_the_head_for_many_initial_errors(capsys):
    """Each of several errors of alpha settles as it does alone; the other angles settle as without it."""
    document = asked(capsys, "settled_below=1e-3", "alpha_error_0=0.1,0.2,0.3")
    alone = [
        asked(capsys, "settled_below=1e-3", f"alpha_error_0={x}")["answers"]["exponential"] for x in (0.1, 0.2, 0.3)
    ]
    for n in ANGLES:
        expected = [answer[f"{n}_settling_time"] for answer in alone]
        # the exponential is stepped to the last crossing, found to 1e-14 s: 1e-12 s measured
        np.testing.assert_allclose(document["answers"]["analytic"][f"{n}_settling_time"], expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("kv", "kp"), [(240.0, 480.0), (4.0, 400.0), (20.0, 100.0), (0.5, 900.0)])
def test_settling_time_is_the_last_crossing(kv, kp):
    rng = np.random.default_rng(3)
    e0, r0 = rng.uniform(-0.3, 0.3, 4), rng.uniform(-5.0, 5.0, 4)
    found = closed.settling_time(e0, r0, kv, kp, 2e-3)
    for e, r, t in zip(e0, r0, found, strict=True):
        after = closed.error_response(t + np.linspace(0.0, 3.0 * t + 1.0, 20001), e, r, kv, kp).error
        assert np.abs(after).max() <= 2e-3 * (1 + 1e-9)
        assert abs(closed.error_response(t, e, r, kv, kp).error) == pytest.approx(2e-3, rel=1e-9)
    assert closed.settling_time([1e-4], [0.0], kv, kp, 1e-3) == [0.0]
    with pytest.raises(MechlabError, match="position_gain"):
        closed.settling_time([0.1], [0.0], kv, 0.0, 1e-3)


def test_dynamics_of_the_head(capsys):
    """Specification, check A8: bias, and M(0.7) with the inertias written there."""
    motion = ("head_beta=0.7", "head_alpha_rate=1", "head_beta_rate=-2", "head_gamma_rate=1.5")
    built = asked(capsys, *motion, "head_gamma_accel=3")["answers"]
    for witness in ("analytic", *ENGINES):
        bias = [built[witness][f"bias_{n}"] for n in ANGLES]
        np.testing.assert_allclose(bias, [6.8836e-5, 4.61241e-4, 1.184085e-3], rtol=0, atol=5.1e-9)
        for key, value in built["mujoco"].items():
            assert built[witness][key] == pytest.approx(value, abs=1e-12), (witness, key)
    parts = ("input_gear=2.04e-3", "third_shaft=2.04e-3", "output_transverse=4.15e-4", "planet_sense=1")
    found = asked(capsys, "head_beta=0.7", *parts)["answers"]
    assert "as it is built" in found["mujoco"]["cannot"]
    said = [found["analytic"][f"mass_{a}"] for a in ("alpha_alpha", "alpha_gamma", "beta_beta", "gamma_gamma")]
    np.testing.assert_allclose(said, [2.613915e-3, 4.515541e-3, 3.048915e-3, 11.056019e-3], rtol=0, atol=5.1e-10)


def test_margins_of_the_workspace(capsys):
    where = ("O_x=50mm", "O_y=0.02", "O_z=-0.02", "bend_limit=60deg", "least_condition=0.1", "r_alpha=0.5")
    document = asked(capsys, *where)
    said = document["answers"]
    for witness in ("analytic", *ENGINES):
        for key, value in said["pinocchio"].items():
            assert said[witness][key] == pytest.approx(value, abs=1e-12), (witness, key)
    each = [said["mujoco"][f"{n}_margin"] for n in ("reach", "slider_min", "slider_max", "bend", "condition")]
    assert said["analytic"]["margin"] == pytest.approx(min(each), abs=1e-12)
    assert said["analytic"]["any_margin"] == pytest.approx(max(each), abs=1e-12)

    def meet(x, y):
        return (x + y - np.sqrt(x * x + y * y - x * y)) / 1.5

    assert said["analytic"]["r_conjunction"] == pytest.approx(reduce(meet, each), abs=1e-12)
    assert said["analytic"]["r_disjunction"] == pytest.approx(-reduce(meet, [-x for x in each]), abs=1e-12)
    assert "bend decides" in document["message"]


def test_margins_beyond_the_workspace(capsys):
    """Specification, section 5: the reach ends 0.1420 m from home in the worst direction."""
    angle = np.radians(np.linspace(0, 360, 721))
    beyond, inside = (
        closed_form("margins of the workspace", O_x=r * np.cos(angle), O_y=r * np.sin(angle), O_z=0.0)["reach_margin"]
        for r in (0.1421, 0.1419)
    )
    assert beyond.min() < 0 < inside.min()
    outside = asked(capsys, "O_x=0.5", "O_y=0", "O_z=0")["answers"]
    assert outside["analytic"]["margin"] < 0 and outside["analytic"]["r_conjunction"] < 0
    assert "no pose has its head centre here" in outside["mujoco"]["cannot"]
    with_gap = asked(capsys, "O_x=0", "O_y=0", "O_z=0", "least_clearance=1mm")["answers"]
    assert "clearance_margin" in with_gap["analytic"] and "margin" not in with_gap["mujoco"]


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (["time=-1"], "time: expected 0 s or more"),
        (["settled_below=0"], "settled_below: expected more than 0 rad"),
        (["settled_below=1e-3", "position_gain=0"], "position_gain = 0.0; expected a finite number greater than 0"),
        (["head_beta=0.1", "planet_sense=0"], "planet_sense = 0; expected +1 or -1"),
        (["head_beta=0.1", "tee_x=-1"], "tee_x = -1.0; expected zero or more"),
        (["O_x=0", "O_y=0", "O_z=0", "r_alpha=1"], "alpha = 1.0; expected 0 <= alpha < 1"),
        (["O_x=0", "O_y=0", "O_z=0", "least_condition=2"], "least_condition = 2.0"),
    ],
)
def test_bad_questions(capsys, keys, said):
    assert main(["solve", "delta6", *keys]) == 1
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1
