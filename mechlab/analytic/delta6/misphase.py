"""Double cardan joint with equal bends whose two forks on the rod are out of phase.

theta_1 is the upper pin's angle from the normal to both shafts' plane, theta_2 the rod's, theta_3 the output's:
tan(theta_2) = c tan(theta_1), tan(theta_3) = tan(theta_2 + delta) / c, c = cos(bend). As a map of directions this is
diag(1, 1/c) R(delta) diag(1, c): a rotation, a stretch and a rotation, which gives the amplitude in closed form.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6._inputs import FloatArray, finite
from mechlab.errors import MechlabError

SMALLEST_COSINE = 1e-12
"""cos(bend) at and below which a joint counts as bent by 90 deg; the cosine of pi/2 itself is 6e-17 in floats."""


def misphase_output(pin_angle: ArrayLike, bend: ArrayLike, misphase: ArrayLike) -> FloatArray:
    """theta_3 for theta_1 = pin_angle, continuous over any number of turns. Arrays broadcast, radians.

    With misphase 0 it is theta_1 itself. Raises MechlabError unless |bend| < 90 deg.
    """
    theta, c, delta = finite("pin_angle", pin_angle), _cosine(bend), finite("misphase", misphase)
    rod = theta + _lag(theta, c)
    return np.asarray(rod + delta + _lag(rod + delta, 1.0 / c))


def misphase_error(pin_angle: ArrayLike, bend: ArrayLike, misphase: ArrayLike) -> FloatArray:
    """Output minus input minus misphase, radians: zero for all angles only with the forks in phase."""
    theta, delta = finite("pin_angle", pin_angle), finite("misphase", misphase)
    return np.asarray(misphase_output(theta, bend, delta) - theta - delta)


def misphase_amplitude(bend: ArrayLike, misphase: ArrayLike) -> FloatArray:
    """Half the swing of `misphase_error` over a turn, arctan(|sin(misphase)| (1/c - c) / 2), c = cos(bend).

    At misphase 90 deg this is asin((1 - k) / (1 + k)) with k = c^2, and the error swings symmetrically about zero.
    """
    c = _cosine(bend)
    return np.asarray(np.arctan(np.abs(np.sin(finite("misphase", misphase))) * (1.0 / c - c) / 2.0))


def _lag(theta: FloatArray, factor: FloatArray) -> FloatArray:
    """arctan(factor tan(theta)) - theta without the jumps of the tangent."""
    s, c = np.sin(theta), np.cos(theta)
    return np.asarray(np.arctan2((factor - 1.0) * s * c, c * c + factor * s * s))


def _cosine(bend: ArrayLike) -> FloatArray:
    c = np.asarray(np.cos(finite("bend", bend)))
    if np.any(c <= SMALLEST_COSINE):
        raise MechlabError("bend reaches 90 deg; expected |bend| < pi/2, where a cardan joint still transmits rotation")
    return c
