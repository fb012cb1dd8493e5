"""Sliding and friction in one gear mesh, and the torque chain of the source's table 1.

The pitch point is the origin, the gear centres lie at A = (-r_a, 0) and C = (r_c, 0), and the contact B at the distance x
along the line of action: B = (x sin(pressure angle), x cos(pressure angle)). Lengths in m, rates in rad/s.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6.geometry import FloatArray, finite, freeze, number
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

PRESSURE_ANGLE = math.radians(20.0)

SOURCE_STAGE_RATIOS = freeze([11.0 / 17.0, 1.0, 31.0 / 30.0, 6.0 / 5.0])
"""Torque ratios of the four stages from the output link (50 N m) to the drive in the source's table 1."""

SOURCE_TABLE_FRICTIONLESS = freeze([50.0, 32.35, 32.35, 33.43, 40.12])
"""Table 1, N m, f = 0: output link, meshes 1 to 3, drive."""

SOURCE_TABLE_FRICTION = freeze([50.0, 33.97, 37.05, 41.19, 49.49])
"""Table 1, N m, f = 0.16."""


@dataclass(frozen=True)
class MeshSliding:
    """Rates (...) of the model's third pair at B and of gear C in rad/s; velocity (..., 2) in m/s."""

    contact_rate: FloatArray
    driven_rate: FloatArray
    velocity: FloatArray


@dataclass(frozen=True)
class TorqueChain:
    """Torques (N m) after each stage, without and with losses, and the growth by friction so far; (stages + 1,)."""

    frictionless: FloatArray
    loaded: FloatArray
    cumulative_loss: FloatArray


def sliding_velocity(
    contact: ArrayLike, radius_a: ArrayLike, radius_c: ArrayLike, rate_a: ArrayLike = 1.0
) -> MeshSliding:
    """Relative velocity of the teeth at B = contact (..., 2) for gear A turning with rate_a.

    Solves w_a + w_b + w_c = 0, sum of p x w + V = 0 at the points A, B, C, and V . B = 0: w_c = w_a r_a / r_c,
    w_b = -(w_a + w_c), V = w_b z x B. In this model w_c is minus the turning rate of gear C.
    """
    b, wa = finite("contact", contact), finite("rate_a", rate_a)
    ra, rc = finite("radius_a", radius_a), finite("radius_c", radius_c)
    if b.shape[-1:] != (2,):
        raise MechlabError(f"contact has shape {b.shape}; expected (..., 2)")
    if np.any(ra <= 0.0) or np.any(rc <= 0.0):
        raise MechlabError("radius_a and radius_c must be positive")
    wc = wa * ra / rc
    wb = -(wa + wc)
    velocity = np.stack(np.broadcast_arrays(-b[..., 1] * wb, b[..., 0] * wb), axis=-1)
    return MeshSliding(np.asarray(wb), np.asarray(wc), velocity)


def tip_distance(teeth: float, module: float = 1.0, pressure_angle: float = PRESSURE_ANGLE) -> float:
    """Distance x from the pitch point to where the tip circle (r + module) cuts the line of action.

    x = sqrt((r + m)^2 - r_b^2) - r sin(pressure angle), r = m teeth / 2, r_b = r cos(pressure angle).
    """
    r = 0.5 * number("module", module, above=0.0) * number("teeth", teeth, above=0.0)
    return math.sqrt((r + module) ** 2 - (r * math.cos(pressure_angle)) ** 2) - r * math.sin(pressure_angle)


def contact_point(distance: ArrayLike, pressure_angle: float = PRESSURE_ANGLE) -> FloatArray:
    """(x sin(pressure angle), x cos(pressure angle)). (...) -> (..., 2)."""
    x = finite("distance", distance)
    return np.stack([x * math.sin(pressure_angle), x * math.cos(pressure_angle)], axis=-1)


def contact_loss(
    driver_teeth: float, driven_teeth: float, friction: float, distance: ArrayLike, pressure_angle: float = PRESSURE_ANGLE
) -> FloatArray:
    """Driver torque over its frictionless value with one contact at the distance s (...) from the pitch point, in modules.

    [1 + f (tan a + s/r_b1) sgn s] / [1 + f (tan a - s/r_b2) sgn s] with 1 the driver; s < 0 in approach, before the pitch
    point. The friction turns round at s = 0, where teeth roll: 1 there. Raises MechlabError where the mesh locks.
    """
    above, below = contact_levers(driver_teeth, driven_teeth, friction, distance, pressure_angle)
    if np.any(below <= 0.0):
        raise MechlabError(
            f"the mesh locks: the loss denominator is {float(below.min()):.3g}; expected a positive value. "
            "Use a smaller friction coefficient"
        )
    return np.asarray(above / below)


def contact_levers(
    driver_teeth: float, driven_teeth: float, friction: float, distance: ArrayLike, pressure_angle: float = PRESSURE_ANGLE
) -> tuple[FloatArray, FloatArray]:
    """Levers (...) of the reaction about driver and driven gear, each over the base radius of that gear; both 1 at s = 0.

    Numerator and denominator of `contact_loss`: torques of several contacts with equal normal forces add up as they do.
    """
    s, f = finite("distance", distance), number("friction", friction)
    tangent, base, side = math.tan(pressure_angle), 0.5 * math.cos(pressure_angle), np.sign(s)
    driver = 1.0 + f * side * (tangent + s / (number("driver_teeth", driver_teeth, above=0.0) * base))
    driven = 1.0 + f * side * (tangent - s / (number("driven_teeth", driven_teeth, above=0.0) * base))
    return np.asarray(driver), np.asarray(driven)


def approach_loss(
    driver_teeth: float, driven_teeth: float, friction: float, pressure_angle: float = PRESSURE_ANGLE
) -> float:
    """`contact_loss` with the contact at the tip of the driven gear, where it begins."""
    begin = -tip_distance(driven_teeth, 1.0, pressure_angle)
    return float(contact_loss(driver_teeth, driven_teeth, friction, begin, pressure_angle))


def recess_loss(
    driver_teeth: float, driven_teeth: float, friction: float, pressure_angle: float = PRESSURE_ANGLE
) -> float:
    """`contact_loss` with the contact at the tip of the driver, where it ends."""
    end = tip_distance(driver_teeth, 1.0, pressure_angle)
    return float(contact_loss(driver_teeth, driven_teeth, friction, end, pressure_angle))


def torque_chain(output: float, ratios: ArrayLike = SOURCE_STAGE_RATIOS, losses: ArrayLike = 1.0) -> TorqueChain:
    """Torques from the output link to the drive; each stage multiplies by ratio * loss.

    output in N m, ratios (n,), losses (n,) or one number; the default losses of 1 mean no friction.
    """
    ratio, loss = np.broadcast_arrays(finite("ratios", ratios), finite("losses", losses))
    start = [number("output", output)]
    frictionless = np.concatenate([start, output * np.cumprod(ratio)])
    growth = np.concatenate([[1.0], np.cumprod(loss)])
    return TorqueChain(frictionless, frictionless * growth, growth - 1.0)
