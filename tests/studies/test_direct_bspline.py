"""The question `bspline`: a speed law along the curve of a file that arrives exactly at its end."""

import json
from pathlib import Path

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic.bspline import SpeedLaw
from mechlab.cli import main
from mechlab.errors import MechlabError, NoSolution

LENGTH = 462.770036091
"""Length of the curve to twelve digits, from adaptive quadrature (scipy 1.17.1, 2026-11): the specification's curve A."""
CURVE = {
    "degree": 3, "knots": [0, 0, 0, 0, 0.2, 0.4, 0.6, 0.8, 1, 1, 1, 1],
    "points": [[0, 0], [60, 80], [120, -40], [180, 60], [240, 0], [300, 90], [340, 20], [400, 0]],
}  # fmt: skip


@pytest.fixture
def curve(tmp_path: Path) -> str:
    path = tmp_path / "curve.json"
    path.write_text(json.dumps(CURVE))
    return str(path)


def test_the_tool_arrives_exactly_at_the_end(curve: str) -> None:
    found = api.solve("bspline", curve=curve, speed=400.0, deceleration=1000.0)
    closed, stepped = found["analytic"], found["stepping"]
    assert closed["end_parameter"] == 1.0 and list(closed["end_point"]) == [400.0, 0.0] and closed["end_gap"] == 0.0
    assert closed["end_rate"] == stepped["end_rate"] == 0.0
    assert stepped["end_gap"] < 1e-7  # 1e-12 of each of the steps of DOP853
    for said in (closed, stepped):
        # By hand: steady up to L - v^2 / (2 a) = L - 80, then v / a = 0.4 s; the parameter there is the specification's.
        assert said["duration"] == pytest.approx((LENGTH - 80.0) / 400.0 + 0.4, abs=1e-11)
        assert said["braking_length"] == pytest.approx(LENGTH - 80.0, abs=1e-8)
        assert said["braking_parameter"] == pytest.approx(0.889764445, abs=1e-9)


@pytest.mark.parametrize("period", [1e-3, 4e-3, 0.03])
def test_a_period_is_met_by_softer_braking(curve: str, period: float) -> None:
    found = api.solve("bspline", curve=curve, speed=400.0, deceleration=1000.0, period=period)
    for said in (found["analytic"], found["stepping"]):
        ticks = said["ticks"]
        assert ticks == np.ceil(((LENGTH - 80.0) / 400.0 + 0.4) / period)
        assert said["duration"] == pytest.approx(ticks * period, rel=1e-12)
        # L = v (T - v / a) + v^2 / (2 a), solved for a, gives where braking begins.
        softer = 400.0 / (2.0 * (ticks * period - LENGTH / 400.0))
        assert said["braking_length"] == pytest.approx(LENGTH - 400.0**2 / (2.0 * softer), abs=1e-6)
    assert found["analytic"]["end_gap"] == 0.0


def test_places_at_times(curve: str) -> None:
    t = [0.0, 0.3, 0.9, 1.2, 5.0]
    found = api.solve("bspline", curve=curve, speed=400.0, deceleration=1000.0, start_speed=100.0, acceleration=600.0, time=t)
    assert found.exit_code == 0 and found.max_difference is not None and found.max_difference < 1e-6
    said = found["analytic"]
    assert said["distance"][1] == pytest.approx(100.0 * 0.3 + 0.5 * 600.0 * 0.3**2, abs=1e-12)
    assert said["rate"][1] == pytest.approx(100.0 + 600.0 * 0.3, abs=1e-12)
    assert said["distance"][-1] == said["length"] and said["rate"][-1] == 0.0
    places = api.solve("toolpath", curve=curve, distance=list(said["distance"][1:4]))
    np.testing.assert_allclose(said["point"][1:4], places["quadrature"]["point"], atol=1e-8)


@pytest.mark.parametrize(
    "law",
    [
        SpeedLaw(10.0, 3.0, 2.0), SpeedLaw(10.0, 3.0, 2.0, 1.0, 0.5, 4.0), SpeedLaw(1.0, 3.0, 2.0, 0.0, 0.0, 4.0),
        SpeedLaw(10.0, 3.0, 2.0, 1.0, 0.5, 4.0).on_ticks(0.25), SpeedLaw(4.0, 3.0, 9.0, 3.0),
    ],
)  # fmt: skip
def test_speed_is_the_slope_of_the_way_and_keeps_its_limits(law: SpeedLaw) -> None:
    t = np.linspace(0.0, law.duration, 20_001)
    h = t[1]
    # The way is of second degree between bends: central differences are exact there, off by d h / 2 across a bend.
    np.testing.assert_allclose((law.at(t[2:]) - law.at(t[:-2])) / (2 * h), law.rate(t[1:-1]), atol=10.0 * h)
    assert np.all(np.diff(law.at(t)) > 0.0) and law.at(law.duration) == law.length and law.at(0.0) == 0.0
    assert law.rate(law.duration) == law.exit_speed and law.rate(t).max() <= law.speed * (1.0 + 1e-15)
    change = np.diff(law.rate(t)) / h
    assert change.min() >= -law.deceleration * (1.0 + 1e-9)
    assert change.max() <= (law.acceleration or 0.0) * (1.0 + 1e-9) + 1e-9


def test_without_braking_the_tool_leaves_at_its_speed(curve: str) -> None:
    found = api.solve("bspline", curve=curve, speed=400.0, exit_speed=400.0, deceleration=1000.0)
    for said in (found["analytic"], found["stepping"]):
        assert said["duration"] == pytest.approx(LENGTH / 400.0, abs=1e-12) and said["end_rate"] == 400.0
        assert said["end_gap"] < 1e-6


def test_what_no_law_can_do(curve: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(NoSolution, match="takes 4.5 m, the way is only 4 m"):
        SpeedLaw(4.0, 3.0, 1.0)
    with pytest.raises(NoSolution, match="no law of this kind arrives at a multiple"):
        SpeedLaw(4.0, 3.0, 2.0).on_ticks(100.0)
    for keys, code, said in (
        (["speed=4000", "deceleration=1000"], 4, "takes 8000 m"), (["speed=4"], 1, "deceleration missing"),
        (["speed=4", "deceleration=1", "start_speed=1"], 1, "acceleration is missing"),
        (["speed=4", "deceleration=1", "start_speed=5", "acceleration=1"], 1, "expected 0 to speed = 4"),
        (["speed=4", "deceleration=1", "period=-1"], 1, "period = -1.0; expected a positive"),
        (["speed=4", "deceleration=1", "time=-1"], 1, "time: expected 0 or more"),
        (["speed=4", "deceleration=1", "tempo=1"], 1, "'tempo' does not exist"),
    ):  # fmt: skip
        assert main(["solve", "bspline", f"curve={curve}", *keys]) == code
        err = capsys.readouterr().err
        assert said in err and err.count("\n") == 1
    with pytest.raises(MechlabError, match="no parameters to vary"):
        api.sensitivity("bspline", curve=curve, speed=1.0, deceleration=1.0)


def test_a_cusp_is_named_and_only_one_witness_passes_it(tmp_path: Path) -> None:
    path = tmp_path / "cusp.json"
    path.write_text(json.dumps({"degree": 3, "knots": [0] * 4 + [1] * 4, "points": [[0, 0], [1, 1], [0, 1], [1, 0]]}))
    found = api.solve("bspline", curve=str(path), speed=1.0, deceleration=4.0)
    # L = 2 sqrt 2 - 1, T = L / v + v / (2 a)
    assert found["analytic"]["duration"] == pytest.approx(2.0 * np.sqrt(2.0) - 1.0 + 0.125, abs=1e-12)
    assert any("stands still at u = 0.5" in note for note in found.answers["analytic"].notes)
    assert "u = 0.5" in found.answers["stepping"].cannot
