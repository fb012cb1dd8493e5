"""Forces in the pins of a moving four-bar, dyad by dyad: coupler and rocker first, the crank last.

The dyad B-C-D is in dynamic equilibrium: the moments on the coupler about C give the component of the force in B across
the coupler, those on the rocker that in D across the rocker; the forces on both give the components along the bars.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.fourbar.dynamics import NO_GRAVITY, LinkMass, MovingFourbar, _gravity, _links, _motion, _offset
from mechlab.analytic.fourbar.kinematics import FloatArray, _finite


@dataclass(frozen=True)
class FourbarForces:
    """Pin forces (..., 2) [N] on the link named second, from the one named first: force_a ground on crank, force_b crank
    on coupler, force_c coupler on rocker, force_d ground on rocker.

    crank_torque (...) [N m]: torque of the drive on the crank, counter-clockwise. shaking_force (..., 2),
    shaking_moment (...) about A: resultant of the inertia forces, which act on the ground in addition to the weight.
    """

    force_a: FloatArray
    force_b: FloatArray
    force_c: FloatArray
    force_d: FloatArray
    crank_torque: FloatArray
    shaking_force: FloatArray
    shaking_moment: FloatArray


def pin_forces(
    bar: MovingFourbar,
    crank_angle: ArrayLike,
    crank_rate: ArrayLike,
    crank_accel: ArrayLike = 0.0,
    gravity: ArrayLike = NO_GRAVITY,
    rocker_torque: ArrayLike = 0.0,
) -> FourbarForces:
    """Forces that the motion needs; arguments broadcast to (...). rocker_torque: load on the rocker, N m, positive
    counter-clockwise.

    Raises NoSolution where the loop does not close or coupler and rocker are in line.
    """
    phi, w, eps = (_finite(n, x) for n, x in zip(
        ("crank_angle", "crank_rate", "crank_accel"), (crank_angle, crank_rate, crank_accel), strict=True))  # fmt: skip
    phi, w, eps, load = np.broadcast_arrays(phi, w, eps, _finite("rocker_torque", rocker_torque))
    g = _gravity(gravity)
    motion = _motion(bar, phi).require()
    links = _links(bar, phi, motion)
    crank, coupler, rocker = (_needs(*link, w, eps, g) for link in links)
    b = bar.crank * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    c = b + bar.coupler * np.stack([np.cos(motion.coupler_angle), np.sin(motion.coupler_angle)], axis=-1)
    d = np.zeros(phi.shape + (2,)) + np.array([bar.ground, 0.0])
    along_b, along_d = (b - c) / bar.coupler, (d - c) / bar.rocker
    # Needed moment about C of each link, of which the pin at the far end gives (r_pin - r_C) x F.
    across_b = (coupler.moment + _cross(coupler.com - c, coupler.force)) / bar.coupler
    across_d = (rocker.moment + _cross(rocker.com - c, rocker.force) - load) / bar.rocker
    missing = coupler.force + rocker.force - across_b[..., None] * _turn(along_b) - across_d[..., None] * _turn(along_d)
    det = _cross(along_b, along_d)
    pull_b, pull_d = _cross(missing, along_d) / det, _cross(along_b, missing) / det
    force_b = pull_b[..., None] * along_b + across_b[..., None] * _turn(along_b)
    force_d = pull_d[..., None] * along_d + across_d[..., None] * _turn(along_d)
    force_a = crank.force + force_b
    torque = crank.moment + _cross(crank.com, crank.force) + _cross(b, force_b)
    parts = (crank, coupler, rocker)
    inertial = [x.force + x.mass * g for x in parts]
    shaking = -np.sum(inertial, axis=0)
    moment = -np.sum([x.moment + _cross(x.com, f) for x, f in zip(parts, inertial, strict=True)], axis=0)
    return FourbarForces(force_a, force_b, rocker.force - force_d, force_d, torque, shaking, moment)


@dataclass(frozen=True)
class _Needs:
    """Force m (a - g) [N] and moment I alpha about its centre of mass `com` [N m] that the pins give a link."""

    force: FloatArray
    moment: FloatArray
    com: FloatArray
    mass: float


def _needs(
    link: LinkMass,
    base: tuple[FloatArray, FloatArray, FloatArray],
    angle: FloatArray,
    rate: FloatArray,
    second: FloatArray,
    w: FloatArray,
    eps: FloatArray,
    g: FloatArray,
) -> _Needs:
    arm = _offset(link, angle)
    r1 = base[1] + rate[..., None] * _turn(arm)
    r2 = base[2] + second[..., None] * _turn(arm) - (rate**2)[..., None] * arm
    a = r1 * eps[..., None] + r2 * (w**2)[..., None]
    return _Needs(link.mass * (a - g), link.inertia * (rate * eps + second * w**2), base[0] + arm, link.mass)


def _turn(v: FloatArray) -> FloatArray:
    return np.stack([-v[..., 1], v[..., 0]], axis=-1)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
