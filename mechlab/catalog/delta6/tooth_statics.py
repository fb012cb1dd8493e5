"""One tooth contact from vectors alone: rigid gears, a normal force along the line of action, Coulomb friction.

The driver stands at A = (-r1, 0) and turns with +1 rad/s, the driven gear at C = (r2, 0); the pitch point is the origin.
The driver pushes along n = (sin 20 deg, cos 20 deg). Written to hold the closed forms of `mechlab.analytic` against.
"""

from __future__ import annotations

import math

import numpy as np

from mechlab.errors import unknown
from mechlab.mechanism.geometry import Array

PRESSURE = math.radians(20.0)


def _cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _contact(teeth: tuple[float, float], module: float, phase: str) -> tuple[Array, Array, Array, Array]:
    """Contact point, centres A and C, normal n; the contact lies where a tip circle cuts the line of action."""
    r1, r2 = (0.5 * module * z for z in teeth)
    n = np.array([math.sin(PRESSURE), math.cos(PRESSURE)])
    a, c = np.array([-r1, 0.0]), np.array([r2, 0.0])
    if phase == "approach":  # tip of the driven gear, before the pitch point
        centre, radius, pick = c, r2 + module, min
    elif phase == "recess":
        centre, radius, pick = a, r1 + module, max
    else:
        raise unknown("phase of a mesh", phase, ("approach", "recess"))
    roots = np.roots([1.0, -2.0 * float(n @ centre), float(centre @ centre) - radius**2]).real
    return float(pick(roots)) * n, a, c, n


def _slide(contact: Array, a: Array, c: Array) -> Array:
    """Velocity of the driver's tooth minus that of the driven one."""
    rate = -float(np.linalg.norm(a) / np.linalg.norm(c))
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    return np.asarray(turn @ (contact - a) - rate * (turn @ (contact - c)))


def sliding(teeth: float, module: float) -> Array:
    """(2,) sliding velocity of two equal gears at the tip of the driver [m/s], with the sign of the source: the velocity
    of the driven tooth against the driver's."""
    contact, a, c, _ = _contact((teeth, teeth), module, "recess")
    return -_slide(contact, a, c)


def loss(driver: float, driven: float, friction: float, phase: str) -> float:
    """Torque of the driver over what it would be without friction, for a given torque of the driven gear."""
    contact, a, c, n = _contact((driver, driven), 1.0, phase)
    slide = _slide(contact, a, c)
    force = n + friction * slide / np.linalg.norm(slide)  # on the driven tooth, dragged along by the driver's
    return _cross(contact - a, force) / -_cross(contact - c, force) * driven / driver
