"""Cardan shafts in closed form: their passive joints, Hooke joints whose forks are out of phase; and formulas that count
freedoms.

Joints of shaft i: a stub in the slider turns by phi about Z, a cross turns by `fork` about the stub's axis a, the rod turns
by `cross` about the common axis b. The rod's orientation is R = Rz(phi) R_a(fork) R_b(cross) with w_i / L = R u0_i. At home
(O = 0, phi = 0) both angles are zero, u0 = w0 / L, b = unit(z x u0), a = z x b. The lower end mirrors the upper one: the lower
cross turns by -cross about b against the rod, and the lower stub by phi about Z with the lower fork at +fork about a against
it. Both forks are in phase, so the lower stub repeats phi exactly.

Forks out of phase by delta, equal bends: theta_1 is the angle of the upper pin from the normal to the plane of the shafts,
theta_2 that of the rod, theta_3 that of the output: tan(theta_2) = c tan(theta_1), tan(theta_3) = tan(theta_2 + delta) / c,
c = cos(bend). As a map of directions this is diag(1, 1/c) R(delta) diag(1, c): a rotation, a stretch and a rotation, which
gives the amplitude in closed form.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6.geometry import Delta6, FloatArray, finite, vectors
from mechlab.analytic.delta6.rotation import wrap
from mechlab.analytic.delta6.translation import leg_heights, leg_vectors
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class CardanAngles:
    """Joint angles of the three cardan shafts, each (..., 3), radians, one entry a leg.

    upper_shaft, upper_fork (about a), upper_cross (about b), lower_cross (about b), lower_fork (about a, seen from the
    lower stub), lower_shaft. bend: angle between rod and shaft axis, acos(h_i / L).
    """

    upper_shaft: FloatArray
    upper_fork: FloatArray
    upper_cross: FloatArray
    lower_cross: FloatArray
    lower_fork: FloatArray
    lower_shaft: FloatArray
    bend: FloatArray


def home_axes(geom: Delta6) -> tuple[FloatArray, FloatArray, FloatArray]:
    """u0, a, b of each leg at home, each (3, 3): rod direction (downwards), fork axis on the stub, axis on the rod."""
    u0 = _rods(geom, np.zeros(3)) / geom.rod_length
    b = np.cross([0.0, 0.0, 1.0], u0)
    b = b / np.linalg.norm(b, axis=-1, keepdims=True)
    return u0, np.cross([0.0, 0.0, 1.0], b), b


def cardan_angles(geom: Delta6, position: ArrayLike, shafts: ArrayLike) -> CardanAngles:
    """All cardan joints for O (..., 3) and shaft angles phi (..., 3), broadcast against each other.

    With v = Rz(-phi) w / L, A0 = u0.a, Z0 = u0.z: t = atan2(-Z0, A0) +- acos((v.a) / hypot(A0, Z0)),
    z1 = A0 sin t + Z0 cos t, fork = atan2((v.b) / z1, (v.z) / z1); the sign with the smaller |fork| is taken.
    Raises NoSolution out of reach and for a horizontal rod.
    """
    phi = vectors("shafts", shafts)
    leg_heights(geom, position)
    u0, a, b = home_axes(geom)
    u = _rods(geom, position) / geom.rod_length
    c, s = np.cos(phi), np.sin(phi)
    v = np.stack(np.broadcast_arrays(c * u[..., 0] + s * u[..., 1], c * u[..., 1] - s * u[..., 0], u[..., 2]), axis=-1)
    va, vb = np.sum(v * a, axis=-1), np.sum(v * b, axis=-1)
    a0, z0 = np.sum(u0 * a, axis=-1), u0[..., 2]
    spread = np.arccos(np.clip(va / np.hypot(a0, z0), -1.0, 1.0))
    candidates = []
    for sign in (1.0, -1.0):
        cross = np.arctan2(-z0, a0) + sign * spread
        z1 = np.copysign(1.0, a0 * np.sin(cross) + z0 * np.cos(cross))
        candidates.append((wrap(cross), np.arctan2(vb * z1, v[..., 2] * z1)))
    (cross_p, fork_p), (cross_m, fork_m) = candidates
    first = np.abs(fork_p) <= np.abs(fork_m)
    cross, fork = np.where(first, cross_p, cross_m), np.where(first, fork_p, fork_m)
    bend = np.broadcast_to(cardan_bend(geom, position), fork.shape)
    shaft = np.broadcast_to(phi, fork.shape)
    return CardanAngles(shaft, fork, cross, -cross, fork, shaft, bend)


def cardan_bend(geom: Delta6, position: ArrayLike) -> FloatArray:
    """Bend acos(h_i / L) of each cardan, computed as atan2(|G_i|, h_i). O (..., 3) -> (..., 3). Raises out of reach."""
    h = leg_heights(geom, position)
    return np.asarray(np.arctan2(np.linalg.norm(leg_vectors(geom, position), axis=-1), h))


def rod_speed_ratio(bend: ArrayLike, pin_angle: ArrayLike) -> FloatArray:
    """Spin rate of the rod over that of its shaft, cos(bend) / (1 - sin^2(bend) sin^2(pin_angle)).

    It runs from cos(bend) to 1 / cos(bend). pin_angle: angle of the driving fork's pin from the normal to shaft and
    rod. O held; arrays broadcast.
    """
    beta, theta = finite("bend", bend), finite("pin_angle", pin_angle)
    return np.asarray(np.cos(beta) / (1.0 - (np.sin(beta) * np.sin(theta)) ** 2))


def rod_speed_ratios(geom: Delta6, position: ArrayLike, shafts: ArrayLike) -> FloatArray:
    """`rod_speed_ratio` of the three rods for O (..., 3) and shaft angles (..., 3) -> (..., 3). Raises out of reach."""
    phi = vectors("shafts", shafts)
    _, a, _ = home_axes(geom)
    u = _rods(geom, position)
    pin = np.arctan2(a[..., 1], a[..., 0]) + phi
    normal = np.arctan2(u[..., 0], -u[..., 1])
    return rod_speed_ratio(cardan_bend(geom, position), pin - normal)


def _rods(geom: Delta6, position: ArrayLike) -> FloatArray:
    """Vectors w_i = (G_i, -h_i) from upper to lower cross centre, (..., 3, 3)."""
    h = leg_heights(geom, position)
    return np.concatenate([leg_vectors(geom, position), -h[..., None]], axis=-1)


# -- forks out of phase ----------------------------------------------------------------------------------------------------

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


# -- counts of freedoms ----------------------------------------------------------------------------------------------------
# n: moving links; p5, p4, p3: pairs with one, two, three freedoms. The formulas know nothing of dimensions: idle spins are
# counted as freedoms, redundant constraints as if they acted.


def somov_malyshev(n: int, p5: int, p4: int = 0, p3: int = 0, p2: int = 0, p1: int = 0) -> int:
    """Spatial chain, W = 6 n - 5 p5 - 4 p4 - 3 p3 - 2 p2 - p1."""
    _counts(n=n, p5=p5, p4=p4, p3=p3, p2=p2, p1=p1)
    return 6 * n - 5 * p5 - 4 * p4 - 3 * p3 - 2 * p2 - p1


def chebyshev(n: int, p5: int, p4: int = 0) -> int:
    """Planar chain, W = 3 n - 2 p5 - p4; p4 counts higher pairs such as gear meshes."""
    _counts(n=n, p5=p5, p4=p4)
    return 3 * n - 2 * p5 - p4


def artobolevsky(n: int, p5: int, p4: int = 0) -> int:
    """Spherical chain, all axes through one point, W = 3 n - 2 p5 - p4; p4 counts bevel meshes."""
    _counts(n=n, p5=p5, p4=p4)
    return 3 * n - 2 * p5 - p4


def _counts(**counts: int) -> None:
    for name, value in counts.items():
        if value != int(value) or value < 0:
            raise MechlabError(f"{name} = {value!r}; expected a count, zero or more")
