"""Checks of the platform: three witnesses, a round trip, the number of modes, a driven run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import assur
from mechlab.analytic.linkage import Linkage, Motion
from mechlab.catalog.platform_3rrr.build import build, driven, linkage_at, reference, style
from mechlab.catalog.platform_3rrr.geometry import DRIVES, POSE, PlatformParameters, elbows, group, home, inverse
from mechlab.catalog.platform_3rrr.questions import QUESTIONS
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.scene import Settings
from mechlab.kit import mass_check
from mechlab.kit.mode_scan import scan_modes, try_modes
from mechlab.kit.planar_mass import planar_state


def _samples(p: PlatformParameters, count: int) -> np.ndarray:
    """(count, 3) drive angles within 0.2 rad of home."""
    return np.array(home(p)) + np.random.default_rng(5).uniform(-0.2, 0.2, (count, 3))


def _poses(p: PlatformParameters) -> CheckResult:
    said: dict[str, list[Any]] = {"analytic": [], "pinocchio": [], "mujoco": []}
    forward = QUESTIONS[0]
    for drives in _samples(p, 4):
        given: dict[str, Any] = dict.fromkeys(forward.optional, 0.4) | dict(zip(DRIVES, drives.tolist(), strict=True))
        for witness, ask in forward.witnesses.items():
            values = ask(p, given).values
            said[witness].append([values[k] for k in forward.answers])
    return CheckResult(said, 1e-8, note="x, y, alpha with rates and accelerations at four random drive positions")


def _round_trip(p: PlatformParameters) -> CheckResult:
    forward, inverse = QUESTIONS
    wanted, got = [], []
    for drives in _samples(p, 4):
        given: dict[str, Any] = dict.fromkeys(forward.optional, 0.3) | dict(zip(DRIVES, drives.tolist(), strict=True))
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
    # As of the round trip.
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
    return CheckResult(
        {"positions where the scan found more": short}, 0.0, 0.0, f"{int(found.sum())} modes at 100 random positions"
    )


def _run(p: PlatformParameters) -> CheckResult:
    from mechlab.engines.mujoco import run

    scene = driven(p, "minimal")
    scene = replace(scene, duration=0.31 * scene.duration)
    truth = reference(p, scene)
    found = run(build(p, "minimal"), scene, Settings(timestep=7e-4, timeconst=4.0), [scene.duration])
    names = [n for n in truth.mechanism.scalar_names if n in found.channels]
    # Softness of MuJoCo's loops: (1 - d) tc^2 x acceleration, below 1e-6 here.
    return CheckResult({"mujoco": [found.channel(n)[-1] for n in names]}, 1e-5, [truth.channel(n)[-1] for n in names])


def _masses(p: PlatformParameters) -> CheckResult:
    m, pairs = build(p, "minimal"), []
    for drives in _samples(p, 2):
        pairs.append((m, planar_state(m, *_moved(p, drives), style(p))))
    return mass_check.compare(pairs)


CHECKS = (
    Check("R1", "poses, rates, accelerations from three witnesses", _poses, "closed form of class III"),
    Check("R2", "drives to pose and back", _round_trip, "class III against dyads"),
    Check("R3", "the polynomial finds no fewer modes than a scan of 720 points", _count, "scan along one chain"),
    Check("R4", "a driven run of MuJoCo against the closed form", _run, "closed form of class III", slow=True),
    Check("R5", mass_check.TEXT, _masses, mass_check.SOURCE),
    Check("R6", "chains as dyads against the motion of class III", _chains, "closed form of the RRR dyad"),
    Check("R7", "closing legs and det J of every mode", _each_mode, "lengths, central differences"),
)
