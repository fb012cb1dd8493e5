"""The governor at moving states in particles, and the check on it."""

from __future__ import annotations

import math

import numpy as np

from mechlab.catalog.flyball.build import build
from mechlab.catalog.flyball.parameters import Parameters
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit import mass_check
from mechlab.mechanism.geometry import axis_rotation

STATES = ((0.4, 0.62, 0.5, 0.8), (1.3, -0.4, 0.9, -0.7)), ((-1.1, 0.31, 0.95, 0.2), (0.6, 0.5, -1.2, 0.3))
"""Shaft angle, slider height, right and left arm angle, then their rates: both arms are free to differ."""


def moving(p: Parameters, at: tuple[float, ...], rates: tuple[float, ...]) -> mass_check.State:
    """Shaft, slider, arms and balls at a state in particles, in the frame of the shaft that turns; springs by their length."""
    names = ("shaft_angle", "slider_height", "right_angle", "left_angle")
    (turned, height, *angles), (turn, climb, *swings) = at, rates
    spin, shaft = np.array([0.0, 0.0, turn]), axis_rotation((0.0, 0.0, 1.0), turned)
    e = p.slider_size / math.sqrt(12.0)
    slender = np.array([p.arm_length, p.section, p.section]) / math.sqrt(12.0)
    post = p.density * p.shaft_length * p.section**2
    post_spread = np.array([p.section, p.section, p.shaft_length]) / math.sqrt(12.0)
    particles = mass_check.solid(post, (0.0, 0.0, 0.5 * p.shaft_length), post_spread, shaft, turn=spin)
    particles += mass_check.solid(p.slider_mass, (0.0, 0.0, height), (e, e, e), shaft, (0.0, 0.0, climb), spin)
    points, stored, lost = {"S": np.array([0.0, 0.0, height])}, 0.0, 0.0
    for side, name, angle, swing in zip((1.0, -1.0), ("right", "left"), angles, swings, strict=True):
        along = shaft @ [side * math.cos(angle), 0.0, -math.sin(angle)]
        across = shaft @ [0.0, side, 0.0]  # the arm falls about it
        pivot, omega = shaft @ [side * p.pivot, 0.0, p.shaft_length], spin + swing * across
        axes = np.column_stack([along, across, np.cross(along, across)])
        arm, hung = p.arm_length * along, np.cross(spin, pivot)
        middle, drift = pivot + 0.5 * arm, hung + 0.5 * np.cross(omega, arm)
        ball, fly = pivot + arm, hung + np.cross(omega, arm)
        particles += mass_check.solid(p.arm_mass, middle, slender, axes, drift, omega)
        particles += mass_check.solid(p.ball_mass, ball, velocity=fly)
        end = shaft @ [side * p.pivot, 0.0, height]
        way, speed = middle - end, drift - np.cross(spin, end) - [0.0, 0.0, climb]
        length = float(np.linalg.norm(way))
        stretch = float(way @ speed) / length
        stored += p.spring_stiffness * (length - p.spring_length) * stretch
        lost += p.damping * stretch**2
        points[f"{name}_ball"] = ball
    values, speeds = (dict(zip(names, x, strict=True)) for x in (at, rates))
    return mass_check.State(values, speeds, particles, points, (0.0, 0.0, -p.gravity), 4, stored=stored, lost=lost)


def _check(p: Parameters) -> CheckResult:
    m = build(p, "full")
    return mass_check.compare([(m, moving(p, at, rates)) for at, rates in STATES])


MOVING = Check("B3", mass_check.TEXT, _check, mass_check.SOURCE)
