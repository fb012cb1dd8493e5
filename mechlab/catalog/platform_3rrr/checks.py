"""Checks of the platform: three witnesses, a round trip, the number of modes, a driven run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import assur
from mechlab.catalog.platform_3rrr.build import build
from mechlab.catalog.platform_3rrr.geometry import DRIVES, POSE, elbows, group, home
from mechlab.catalog.platform_3rrr.parameters import PlatformParameters
from mechlab.catalog.platform_3rrr.questions import QUESTIONS
from mechlab.catalog.platform_3rrr.scenes import driven, reference
from mechlab.experiment.check import Check, Measured
from mechlab.experiment.settings import Settings
from mechlab.study.mode_scan import scan_modes


def _samples(p: PlatformParameters, count: int) -> np.ndarray:
    """(count, 3) drive angles within 0.2 rad of home."""
    return np.array(home(p)) + np.random.default_rng(5).uniform(-0.2, 0.2, (count, 3))


def _poses(p: PlatformParameters) -> Measured:
    said: dict[str, list[Any]] = {"analytic": [], "pinocchio": [], "mujoco": []}
    forward = QUESTIONS[0]
    for drives in _samples(p, 4):
        given: dict[str, Any] = dict.fromkeys(forward.optional, 0.4) | dict(zip(DRIVES, drives.tolist(), strict=True))
        for witness, ask in forward.witnesses.items():
            values = ask(p, given).values
            said[witness].append([values[k] for k in forward.answers])
    return Measured(said, 1e-8, note="x, y, alpha with rates and accelerations at four random drive positions")


def _round_trip(p: PlatformParameters) -> Measured:
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
    return Measured({"inverse of forward": got}, 1e-9, wanted, "drives to pose (class III) and back (dyads)")


def _count(p: PlatformParameters) -> Measured:
    drives = np.array(home(p)) + np.random.default_rng(6).uniform(-np.pi, np.pi, (100, 3))
    g = group(p, elbows(p, drives.T)).flat()
    found = assur.all_modes(g).count
    scanned = np.array([scan_modes(g.take(np.array([k])), 720) for k in range(100)])
    short = int(np.count_nonzero(found < scanned))
    return Measured(
        {"positions where the scan found more": short}, 0.0, 0.0, f"{int(found.sum())} modes at 100 random positions"
    )


def _run(p: PlatformParameters) -> Measured:
    from mechlab.simulate import run

    scene = driven(p, "minimal")
    scene = replace(scene, duration=0.31 * scene.duration)
    truth = reference(p, scene)
    found = run(build(p, "minimal"), scene, Settings(timestep=7e-4, timeconst=4.0), [scene.duration])
    names = [n for n in truth.mechanism.scalar_names if n in found.channels]
    # Softness of MuJoCo's loops: (1 - d) tc^2 x acceleration, below 1e-6 here.
    return Measured({"mujoco": [found.channel(n)[-1] for n in names]}, 1e-5, [truth.channel(n)[-1] for n in names])


CHECKS = (
    Check("R1", "poses, rates, accelerations from three witnesses", _poses, "closed form of class III"),
    Check("R2", "drives to pose and back", _round_trip, "class III against dyads"),
    Check("R3", "the polynomial finds no fewer modes than a scan of 720 points", _count, "scan along one chain"),
    Check("R4", "a driven run of MuJoCo against the closed form", _run, "closed form of class III", slow=True),
)
