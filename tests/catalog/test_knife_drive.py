"""The knife drive of the three-knife cutter: work of the cut, torque by virtual work, a run with motor, flywheel and forces."""

import math
from dataclasses import replace

import numpy as np
import pytest

import mechlab as ml
from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.gear_linkage.claims import CLAIMS
from mechlab.catalog.gear_linkage.knife import Parameters
from mechlab.catalog.knife_drive import ENTRY
from mechlab.errors import MechlabError
from mechlab.kit.cutting import Cutting

P = Parameters()


@pytest.mark.parametrize("mount", [0.3, 2.83, 5.0])
def test_the_cut_takes_force_times_stack(mount: float) -> None:
    """The integral of the torque over a turn is the height of the stack, whatever the linkage."""
    phi = np.linspace(0.0, 2.0 * math.pi, 200_001)
    work = float(np.sum(closed_form.cutting_torque(P.linkage, P.knife, mount, phi[:-1]))) * phi[1]
    assert work == pytest.approx(P.stack, rel=1e-4)  # the raster misses the begin of the cut by a step


def test_clutch_torque_by_hand() -> None:
    """Where the pin is level with its axis the slope is the throw; half a turn of rest doubles it."""
    deep = closed_form.Knife(0.1, 1e4, 0.15)  # an endless rod: y = r sin a, steepest in the middle of the stroke, which is cut
    assert closed_form.clutch_torque(deep, 0.0) == pytest.approx(0.1, rel=1e-4)
    assert closed_form.clutch_torque(deep, math.pi) == pytest.approx(0.2, rel=1e-4)
    thin = closed_form.Knife(0.1, 1e4, 0.02)  # cut from sin a = -0.8 on, where cos a = 0.6
    assert closed_form.clutch_torque(thin, 0.0) == pytest.approx(0.06, rel=1e-3)


def test_without_eccentricity_the_linkage_is_the_clutch_that_never_rests() -> None:
    even = replace(P, crank=1e-9).linkage
    assert float(closed_form.torque_factor(even, P.knife, 1.0, 0.0)) == pytest.approx(1.0, rel=1e-3)
    mount, factor = closed_form.best_mount(P.linkage, P.knife, 0.0)
    assert factor == pytest.approx(1.8, abs=0.005) and mount == pytest.approx(P.mount, abs=0.02)


def test_bad_knives() -> None:
    for sizes in ((0.1, 0.05, 0.05), (0.1, 0.3, 0.25), (0.0, 0.3, 0.1)):
        with pytest.raises(MechlabError, match="0 < throw < rod"):
            closed_form.Knife(*sizes)
    with pytest.raises(MechlabError, match="less than a turn"):
        closed_form.clutch_torque(P.knife, 7.0)
    with pytest.raises(MechlabError, match="once in a turn"):
        closed_form.torque_factor(closed_form.GearLinkage(0.3, 1.0, 0.8, 0.4), P.knife, 0.0, 0.0)


def test_cutting_force() -> None:
    law = Cutting("knife", 10.0, -0.5, -0.4)
    assert law.at(-0.39, -1.0) == 0.0 and law.at(-0.45, 1.0) == 0.0  # above the stack; on the way up
    assert law.at(-0.45, -1.0) == 10.0 and law.at(-0.405, -1.0) == pytest.approx(5.0)


def test_cutting_by_three_witnesses() -> None:
    ends = [ml.simulate(ENTRY, scene="cutting", duration=1.2, engine=e).final() for e in ("mujoco", "pinocchio", "one_freedom")]
    for name in ("shaft", "shaft_rate", "knife_sides", "knife_front"):
        # steps of 1 ms across the begin of a cut
        assert ends[0][name] == pytest.approx(ends[1][name], abs=1e-4) and ends[1][name] == pytest.approx(ends[2][name], abs=1e-4)


def test_the_motor_pays_for_the_cuts() -> None:
    """In a settled turn the motor gives what both knives take: force x stack, less half of the first tenth, in which it grows."""
    found = ml.simulate(ENTRY, scene="cutting")
    t, angle, rate = found.t, found.channel("shaft"), found.channel("shaft_rate")
    turn = np.linspace(angle[-1] - 2.0 * math.pi, angle[-1], 20_001)
    torque = P.stall * (1.0 - np.interp(turn, angle, rate) / P.no_load)
    work = 2.0 * P.cutting_force * 0.95 * P.stack
    assert float(np.mean(torque)) * 2.0 * math.pi == pytest.approx(work, rel=2e-3)  # channels at some hundred times of a turn
    assert np.all(np.diff(t) > 0.0)


def test_a_larger_flywheel_evens_the_speed() -> None:
    swings = []
    for flywheel in (50.0, 200.0):
        rate = ml.simulate(ENTRY, scene="cutting", flywheel=flywheel).channel("shaft_rate")
        swings.append(float(np.ptp(rate[len(rate) // 2 :])))
    assert swings[1] < 0.5 * swings[0]


def test_verdict_feels_a_wrong_torque(monkeypatch: pytest.MonkeyPatch) -> None:
    claim = next(c for c in CLAIMS if c.id == "G9")
    assert claim.test().verdict.name == "CANNOT"
    monkeypatch.setattr(closed_form.knife, "clutch_torque", lambda knife, rest: 0.05)
    assert claim.test().verdict.name == "FAILS"
