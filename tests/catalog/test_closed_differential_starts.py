"""Starts of the closed differential under a dry load, and its torque converter, against hand formulas of the specification's
numbers."""

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential import ENTRY
from mechlab.catalog.closed_differential.checks import LAB, _run
from mechlab.catalog.closed_differential.claims import CLAIMS
from mechlab.errors import MechlabError, NoSolution

J11, J12, J22 = 0.46434667, -0.48858667, 1.40314667  # mass matrix in (w_H1, w_H2), specification
ENGINES = ("analytic", "mujoco", "pinocchio")


def final(scene: str, **options: object) -> dict[str, float]:
    found = api.simulate(ENTRY, scene=scene, **options)
    assert found.health.trusted
    return found.final()


@pytest.mark.parametrize("engine", ENGINES)
def test_never_starts_at_200_and_starts_below_its_own_moment(engine: str) -> None:
    """The output feels -J12/J11 x 100 N m = 105.22 N m while it stands; the input gains 100/J11 each second."""
    stands = final("dry-start", engine=engine, duration=0.3)
    assert stands["w_H2"] == pytest.approx(0.0, abs=1e-9)
    assert stands["w_H1"] == pytest.approx(0.3 * 100 / J11, rel=1e-7)  # the matrix is printed with 8 digits
    limit = -J12 / J11 * 100
    assert final("dry-start", engine=engine, duration=0.1, M_H2=limit + 0.1)["w_H2"] == pytest.approx(0.0, abs=1e-9)
    moving = final("dry-start", engine=engine, duration=0.1, M_H2=limit - 10.0)
    # held, the output has w_H1' = 100/J11; 10 N m less of load: 10 N m on (J22 - J12^2/J11)
    assert moving["w_H2"] == pytest.approx(0.1 * 10.0 / (J22 - J12**2 / J11), rel=1e-6)


@pytest.mark.parametrize("engine", ENGINES)
def test_braked_start_is_a_gear_of_ratio_four(engine: str) -> None:
    inertia = 16 * J11 + 8 * J12 + J22
    found = final("braked-start", engine=engine, duration=0.3)
    assert found["w_H2"] == pytest.approx(0.3 * (400 - 200) / inertia, rel=1e-6)
    assert found["w_H1"] == pytest.approx(4 * found["w_H2"], abs=1e-6) and found["w3"] == pytest.approx(0.0, abs=1e-6)
    assert final("braked-start", engine=engine, duration=0.2, M_H2=401.0)["w_H2"] == pytest.approx(0.0, abs=1e-9)
    # a brake of 50 N m slips: block 36 turns, the output does not start
    assert final("braked-start", engine=engine, duration=0.2, brake_moment=50.0)["w_H2"] == pytest.approx(0.0, abs=1e-9)


def test_released_output_stops() -> None:
    brakes = (J11 * -200 - J12 * 100) / (J11 * J22 - J12**2)  # w_H2' of free motion
    found = api.simulate(ENTRY, scene="brake-released", duration=0.4)
    before, after = (float(np.interp(25 / -brakes + dt, found.t, found.channel("w_H2"))) for dt in (-0.01, 0.01))
    assert before == pytest.approx(-0.01 * brakes, rel=2e-3)  # the capture of the rate smooths the last 0.05 rad/s
    assert after == pytest.approx(0.0, abs=1e-6)


def test_converter_by_hand() -> None:
    """Load ratio 2: r = 1/3, s = 2/3, so the converter gives 4 times its moment, at n = 4 x 0.85 (5 - 4)/25 = 0.136."""
    state = closed.converter_state(LAB.train, LAB.converter(), 100.0, 200.0)
    pump = np.sqrt(100 / 3 / (6e-4 * (1 - 0.136**2)))
    assert state.w1 == pytest.approx(pump) and state.w_H2 == pytest.approx(0.136 * pump)
    assert state.w_H1 / state.w_H2 == pytest.approx(1 / 3 / 0.136 + 2 / 3)
    assert state.efficiency == pytest.approx(2 / (1 / 3 / 0.136 + 2 / 3))
    assert state.w_H1 == pytest.approx(0.4 * state.w1 + 0.6 * state.w3) and state.w_H2 == pytest.approx(0.1 * state.w1 + 0.9 * state.w3)
    # power that is lost is what the converter loses: pump moment x pump speed - turbine moment x its speed
    lost = 100 * state.w_H1 - 200 * state.w_H2
    assert lost == pytest.approx(100 / 3 * state.w1 - 400 / 3 * state.w_H2)


@pytest.mark.parametrize("load", [140.0, 200.0, 225.0])
def test_lossless_converter_gives_equation_10(load: float) -> None:
    found = final("lossless-converter", engine="analytic", duration=12.0, M_H2=load)
    assert 100 * found["w_H1"] == pytest.approx(load * found["w_H2"], rel=1e-4)  # what is left of the start, at 140 N m


@pytest.mark.parametrize("scene", ["torque-converter", "lossless-converter"])
def test_converter_by_three_witnesses_from_two_starts(scene: str) -> None:
    """RK4 with 1 ms against DOP853 at 1e-11, in every fidelity; and the steady state, wherever it starts."""
    for options in ({"engine": "mujoco"}, {"engine": "pinocchio"}, {"engine": "mujoco", "fidelity": "full"}):
        found, truth = (final(scene, duration=0.3, **x) for x in (options, {"engine": "analytic"}))
        for name in ("w_H1", "w_H2", "w1", "w3"):
            assert found[name] == pytest.approx(truth[name], abs=1e-5)
    ends = [final(scene, engine="analytic", duration=12.0, w_H1_0=a, w_H2_0=b) for a, b in ((100.0, 50.0), (20.0, 5.0))]
    assert ends[0]["w_H2"] == pytest.approx(ends[1]["w_H2"], abs=1e-4)
    # nothing but the reactor holds the housing: without it angular momentum would fall by 100 N m
    slow = final(scene, engine="analytic", duration=11.9)
    assert ends[0]["angular_momentum"] == pytest.approx(slow["angular_momentum"], abs=1e-4)


def test_bad_converters() -> None:
    converter = LAB.converter()
    for load in (90.0, 240.0):
        with pytest.raises(NoSolution, match="moment ratio"):
            closed.converter_state(LAB.train, converter, 100.0, load)
    with pytest.raises(MechlabError, match="capacity > 0"):
        closed.Converter(0.0, 5.0, 0.85)
    with pytest.raises(MechlabError, match="z1/z3 > z4/z6"):
        closed.converter_state(closed.Train(18, 72, 162, 72, 18, 108), converter, 100.0, 150.0)
    with pytest.raises(MechlabError, match="M_H1 > 0"):
        closed.converter_state(LAB.train, converter, -1.0, 150.0)
    # an overrun pump or one that stands takes nothing and gives nothing more
    assert converter.moments(0.0, 10.0) == pytest.approx((-0.06, -0.06)) and converter.moments(0.0, 0.0) == (0.0, 0.0)


def test_verdicts_follow_the_physics(monkeypatch: pytest.MonkeyPatch) -> None:
    """L8 to L10 as they stand, and L8 with a converter whose losses are forgotten in one place."""
    claims = {c.id: c for c in CLAIMS}
    assert [claims[k].test().verdict.name for k in ("L8", "L9", "L10")] == ["HOLDS", "FAILS", "HOLDS_ONLY_IF"]
    monkeypatch.setattr(closed.Converter, "ratio", lambda self, n: self.stall)
    _run.cache_clear()
    assert claims["L8"].test().verdict.name == "FAILS"
    _run.cache_clear()
