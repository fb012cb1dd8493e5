"""Checks of the platform: three witnesses, a round trip, the number of modes, a driven run."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechlab.analytic import assur
from mechlab.analytic.linkage import Linkage, Motion
from mechlab.catalog.platform_3rrr.build import (
    DRIVES,
    POSE,
    PlatformParameters,
    build,
    driven,
    elbows,
    group,
    home,
    inverse,
    linkage_at,
    reference,
    style,
)
from mechlab.catalog.platform_3rrr.questions import QUESTIONS
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit.checks import by_witnesses, driven_run, moving_check
from mechlab.kit.mass_check import State
from mechlab.kit.mode_scan import scan_modes, try_modes
from mechlab.kit.planar_mass import planar_state


def _samples(p: PlatformParameters, count: int) -> np.ndarray:
    """(count, 3) drive angles within 0.2 rad of home."""
    return np.array(home(p)) + np.random.default_rng(5).uniform(-0.2, 0.2, (count, 3))


def _asked(p: PlatformParameters, rate: float) -> list[dict[str, Any]]:
    """Four random drive positions, all rates and accelerations alike."""
    names = QUESTIONS[0].optional
    return [dict.fromkeys(names, rate) | dict(zip(DRIVES, x.tolist(), strict=True)) for x in _samples(p, 4)]


def _poses(p: PlatformParameters) -> CheckResult:
    note = "x, y, alpha with rates and accelerations at four random drive positions"
    return by_witnesses(p, QUESTIONS[0], _asked(p, 0.4), 1e-8, note, turned=False)


def _round_trip(p: PlatformParameters) -> CheckResult:
    forward, inverse = QUESTIONS
    wanted, got = [], []
    for given in _asked(p, 0.3):
        pose = forward.witnesses["analytic"](p, given).values
        keys = [f"{n}{s}" for n in POSE for s in ("", "_rate", "_accel")]
        back = inverse.witnesses["analytic"](p, {k: float(pose[k]) for k in keys}).values
        wanted.append([given[k] for k in inverse.answers])
        got.append([float(back[k]) for k in inverse.answers])
    # Rounding grows with the condition of the pose and of the acceleration: 1e-9 leaves three digits.
    return CheckResult({"inverse of forward": got}, 1e-9, wanted, "drives to pose (class III) and back (dyads)")


def _chains(p: PlatformParameters) -> CheckResult:
    """Each chain as a dyad between its base pivot and the corner of the platform, against the motion of class III."""
    k = p.elbow or 1
    wanted, got = [], []
    for drives in _samples(p, 2):
        motion = _moved(p, drives)[1]
        for i, d in enumerate(inverse(p, motion.points["centre"], motion.turns["platform"], (k, k, k))):
            arm, leg, pin = motion.turns[f"arm_{i + 1}"], motion.turns[f"leg_{i + 1}"], motion.points[f"B{i + 1}"]
            crank, back = d.angles
            sine = np.sin(leg.x + np.pi - arm.x)
            wanted.append([np.cos(arm.x), np.sin(arm.x), arm.v, arm.a, -np.cos(leg.x), -np.sin(leg.x), leg.v, leg.a,
                           *pin.xy().ravel(), sine, sine**2, 0.0])  # fmt: skip
            got.append([np.cos(crank.x), np.sin(crank.x), crank.v, crank.a, np.cos(back.x), np.sin(back.x), back.v, back.a,
                        *d.joint.xy().ravel(), d.quality, d.discriminant, d.gap])  # fmt: skip
    # The tolerance is that of the round trip.
    return CheckResult({"dyads": got}, 1e-9, wanted, "turns, elbows and transmission of the three chains")


def _each_mode(p: PlatformParameters) -> CheckResult:
    g = group(p, elbows(p, _samples(p, 4).T))
    return try_modes(g, assur.all_modes(g))


def _moved(p: PlatformParameters, drives: np.ndarray) -> tuple[Linkage, Motion]:
    """The chain in its mode at drive angles (3,), and its motion at three different speeds."""
    chain = linkage_at(p, drives)
    return chain, chain.solve(**{f"arm_{k + 1}": (float(x), 0.9 - 0.5 * k, 0.3) for k, x in enumerate(drives)})


def _count(p: PlatformParameters) -> CheckResult:
    drives = np.array(home(p)) + np.random.default_rng(6).uniform(-np.pi, np.pi, (100, 3))
    g = group(p, elbows(p, drives.T)).flat()
    found = assur.all_modes(g).count
    scanned = np.array([scan_modes(g.take(np.array([k])), 720) for k in range(100)])
    short = int(np.count_nonzero(found < scanned))
    note = f"{int(found.sum())} modes at 100 random positions"
    return CheckResult({"positions where the scan found more": short}, 0.0, 0.0, note)


def _run(p: PlatformParameters) -> CheckResult:
    return driven_run(build(p, "minimal"), driven(p, "minimal"), reference, p, 0.31)


def _states(p: PlatformParameters) -> list[State]:
    return [planar_state(build(p, "minimal"), *_moved(p, drives), style(p)) for drives in _samples(p, 2)]


CHECKS = (
    Check("R1", "poses, rates, accelerations from three witnesses", _poses, "closed form of class III"),
    Check("R2", "drives to pose and back", _round_trip, "class III against dyads"),
    Check("R3", "the polynomial finds no fewer modes than a scan of 720 points", _count, "scan along one chain"),
    Check("R4", "a driven run of MuJoCo against the closed form", _run, "closed form of class III", slow=True),
    moving_check("R5", build, "minimal", _states),
    Check("R6", "chains as dyads against the motion of class III", _chains, "closed form of the RRR dyad"),
    Check("R7", "closing legs and det J of every mode", _each_mode, "lengths, central differences"),
)
