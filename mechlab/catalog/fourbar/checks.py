"""Checks of the four-bar: each compares witnesses that do not share code."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np

from mechlab.analytic import fourbar as closed_form
from mechlab.catalog.fourbar.build import build, start_angle, width
from mechlab.catalog.fourbar.parameters import Parameters
from mechlab.catalog.fourbar.questions import QUESTION
from mechlab.catalog.fourbar.scenes import free, reference
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.scene import Settings
from mechlab.kit import mass_check


def _check_pose(p: Parameters) -> CheckResult:
    limits = closed_form.crank_limits(*p.lengths)
    if not limits.full_turn and not limits.ranges:
        return CheckResult({}, 0.0, note="no assembly exists with these lengths")
    low, high = (-math.pi, math.pi) if limits.full_turn else limits.ranges[0]
    grid = np.linspace(low, high, 9)[1:-1]
    said: dict[str, list[Any]] = {"analytic": [], "pinocchio": [], "mujoco": []}
    for phi in grid:
        given = {"crank_angle": float(phi), "crank_rate": 1.3, "crank_accel": -0.7}
        for witness, ask in QUESTION.witnesses.items():
            values = ask(p, given).values
            row = [math.sin(values["coupler_angle"]), math.cos(values["rocker_angle"])]
            said[witness].append([*row, *(values[k] for k in QUESTION.answers[2:])])
    return CheckResult(said, 1e-8, note="coupler and rocker at 7 crank angles: angles, rates, accelerations")


def _check_energy(p: Parameters) -> CheckResult:
    from mechlab.engines.mujoco import run as run_mujoco
    from mechlab.engines.pinocchio import run as run_pinocchio

    scene = free(p, "minimal")
    expected = reference(p, scene).channel("crank_angle_rate")[-1]
    settings = Settings(timestep=7e-4)
    end = {
        "mujoco": run_mujoco(build(p, "minimal"), scene, settings).channel("crank_angle_rate")[-1],
        "pinocchio": run_pinocchio(build(p, "minimal"), scene, Settings(engine="pinocchio", timestep=7e-4)).channel(
            "crank_angle_rate"
        )[-1],
    }
    # MuJoCo's loop is soft to second order in the step: 1e-5 relative at 0.7 ms, in a motion of a few turns.
    return CheckResult(end, 1e-4 * max(1.0, abs(p.speed)), expected, "crank speed after a free run of 2 s")


def _check_limits(p: Parameters) -> CheckResult:
    """Where the crank can stand, of this four-bar and of two that only rock: by trying, then halving the step at each end."""
    expected, found = [], []
    for crank, coupler, rocker, ground in (p.lengths, (1.0, 0.8, 0.5, 1.1), (0.9, 0.6, 1.2, 1.0)):
        ranges = closed_form.crank_limits(crank, coupler, rocker, ground).ranges
        expected += [x for pair in ranges for x in pair]
        found += _tried(crank, coupler, rocker, ground, [0.5 * (a + b) for a, b in ranges])
    # The closure itself is blurred where the bars stretch: sqrt(1e-12).
    return CheckResult({"tried": found}, 1e-6, expected, "ends of the ranges of the crank [rad]")


def _tried(crank: float, coupler: float, rocker: float, ground: float, middles: list[float]) -> list[float]:
    """Low and high end of the range about each middle, at most half a turn away."""

    def closes(angle: float) -> bool:
        far = math.hypot(ground - crank * math.cos(angle), crank * math.sin(angle))
        return abs(coupler - rocker) <= far <= coupler + rocker

    out = []
    for middle in middles:
        for sign in (-1.0, 1.0):
            inside, step = 0.0, 1e-3
            while step > 1e-9:
                if inside + step <= math.pi and closes(middle + sign * (inside + step)):
                    inside += step
                else:
                    step *= 0.5
            out.append(middle + sign * inside)
    return out


def _check_sides(p: Parameters) -> CheckResult:
    """The angle at C and what is missing where C does not exist, from the distance of B and D; also of a four-bar that rocks."""
    said, expected, phi = list[Any](), list[Any](), np.linspace(-3.0, 3.0, 13)
    for crank, coupler, rocker, ground in (p.lengths, (1.0, 0.8, 0.5, 1.1)):
        found = closed_form.solve(crank, coupler, rocker, ground, phi, mode=p.mode)
        far = np.abs(ground - crank * np.exp(1j * phi))
        missing = np.maximum(np.maximum(far - coupler - rocker, abs(coupler - rocker) - far), 0.0)
        cosine = (coupler**2 + rocker**2 - far**2) / (2.0 * coupler * rocker)
        said += [np.where(found.assembles, found.transmission_angle, 0.0), found.gap]
        expected += [np.where(missing > 0.0, 0.0, np.arccos(np.clip(cosine, -1.0, 1.0))), missing]
    # Where the bars stretch the cosine blurs the angle: sqrt(1e-16).
    return CheckResult({"analytic": said}, 1e-7, expected, "transmission angle [rad], gap [m] at 13 crank angles")


def _check_masses(p: Parameters) -> CheckResult:
    m, gravity, pairs = build(p, "minimal"), (0.0, 0.0, -p.gravity), list[mass_check.Pair]()
    start, limits = start_angle(p), closed_form.crank_limits(*p.lengths)
    room = 1.0 if limits.full_turn or not limits.ranges else limits.ranges[0][1] - start
    for phi, rate in ((start, 1.3), (start + 0.3 * room, -0.7)):
        pose = closed_form.solve(*p.lengths, phi, rate, mode=p.mode).require()
        psi, chi, turn, swing = (
            float(x) for x in (pose.coupler_angle, pose.rocker_angle, pose.coupler_rate, pose.rocker_rate)
        )
        place = {"A": 0.0, "B": cmath.rect(p.crank, phi), "C": p.ground + cmath.rect(p.rocker, chi), "D": p.ground}
        speed = {"A": 0.0, "B": 1j * rate * place["B"], "C": 1j * swing * (place["C"] - p.ground), "D": 0.0}
        at, going = ({n: np.array([z.real, 0.0, z.imag]) for n, z in table.items()} for table in (place, speed))
        particles = mass_check.NOTHING
        for a, b, length in (("A", "B", p.crank), ("B", "C", p.coupler), ("D", "C", p.rocker)):
            mass, radius = p.mass_per_length * length, 0.25 * width(p, length)
            particles += mass_check.rod(mass, at[a], at[b], going[a], going[b], radius)
        values = {"crank_angle": phi, "coupler_joint": psi - phi, "rocker_angle": chi, "coupler_angle": psi}
        rates = {"crank_angle": rate, "coupler_joint": turn - rate, "rocker_angle": swing, "coupler_angle": turn}
        points = {"B": at["B"], "C": at["C"], "middle": (at["B"] + at["C"]) / 2.0}
        pairs.append((m, mass_check.State(values, rates, particles, points, gravity, 1, is_reference=not pairs)))
    return mass_check.compare(pairs)


CHECKS = (
    Check("F1", "position, rate and acceleration from three witnesses", _check_pose, "closed form of the RRR dyad"),
    Check("F2", "free run against the equation of the one freedom", _check_energy, "Eksergian equation, DOP853"),
    Check("F3", "range of the crank", _check_limits, "by trying"),
    Check("F4", "transmission angle and gap", _check_sides, "law of cosines"),
    Check("F5", mass_check.TEXT, _check_masses, mass_check.SOURCE),
)
