"""The four-bar as one freedom, and the forces in its pins.

    J(phi) phi'' + J'(phi) phi'^2 / 2 = torque + sum of m g . dr/dphi

The pin forces follow dyad by dyad, the crank last. The dyad B-C-D is in dynamic equilibrium: the moments on the coupler
about C give the component of the force in B across the coupler, those on the rocker that in D across the rocker; the
forces on both give the components along the bars.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.blocks import FloatArray
from mechlab.analytic.fourbar.kinematics import FourbarMotion, _finite, solve
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass

NO_GRAVITY = (0.0, 0.0)

WAY_STEP = math.radians(0.5)
"""Spacing at which `energy_speed` looks for a barrier between the start and the requested angles, rad."""


@dataclass(frozen=True)
class LinkMass:
    """mass (kg), com_along and com_across (m) of the centre of mass, inertia (kg m^2) about it.

    Along runs from the link's first joint to its second: A -> B for the crank, B -> C coupler, D -> C rocker; across
    is 90 deg counter-clockwise from it. Raises MechlabError for a negative mass or inertia.
    """

    mass: float
    com_along: float
    inertia: float
    com_across: float = 0.0

    def __post_init__(self) -> None:
        for name in ("mass", "com_along", "inertia", "com_across"):
            value = getattr(self, name)
            if not math.isfinite(value) or (name in ("mass", "inertia") and value < 0.0):
                raise MechlabError(f"{name} = {value!r}; expected a finite number, mass and inertia zero or more")


@dataclass(frozen=True)
class MovingFourbar:
    """A four-bar with masses: lengths in metres, mode as in `solve`, masses of the three moving links."""

    crank: float
    coupler: float
    rocker: float
    ground: float
    crank_mass: LinkMass
    coupler_mass: LinkMass
    rocker_mass: LinkMass
    mode: int = 1


@dataclass(frozen=True)
class ReducedInertia:
    """J(phi) in kg m^2 and dJ/dphi in kg m^2/rad, in the shape of the crank angles."""

    inertia: FloatArray
    slope: FloatArray


def slender_rod(mass: float, length: float) -> LinkMass:
    """Uniform thin rod: centre of mass in the middle, inertia mass length^2 / 12."""
    return LinkMass(mass, 0.5 * length, mass * length**2 / 12.0)


def rod_fourbar(
    crank: float, coupler: float, rocker: float, ground: float, mass_per_length: float, mode: int = 1
) -> MovingFourbar:
    """Four-bar whose moving links are uniform thin rods of the same mass per length, kg/m."""
    links = [slender_rod(mass_per_length * length, length) for length in (crank, coupler, rocker)]
    return MovingFourbar(crank, coupler, rocker, ground, links[0], links[1], links[2], mode)


def generalised_inertia(bar: MovingFourbar, crank_angle: ArrayLike) -> ReducedInertia:
    """J = sum of m |dr/dphi|^2 + I (d angle/dphi)^2 over the moving links, and its derivative. (...) -> (...).

    Raises NoSolution where the loop does not close or coupler and rocker are in line.
    """
    inertia, slope, _ = _reduce(bar, crank_angle)
    return ReducedInertia(inertia, slope)


def potential_energy(bar: MovingFourbar, crank_angle: ArrayLike, gravity: ArrayLike) -> FloatArray:
    """-sum of m g . r in J, zero for all masses at A. gravity: vector (2,) in m/s^2, e.g. (0, -9.81)."""
    phi, g = _finite("crank_angle", crank_angle), _gravity(gravity)
    motion = _motion(bar, phi)
    energy = np.zeros(phi.shape)
    for link, base, angle, _, _ in _links(bar, phi, motion):
        r = base[0] + _offset(link, angle)
        energy -= link.mass * (r @ g)
    return energy


def acceleration(
    bar: MovingFourbar,
    crank_angle: ArrayLike,
    crank_rate: ArrayLike,
    torque: ArrayLike = 0.0,
    gravity: ArrayLike = NO_GRAVITY,
) -> FloatArray:
    """Exact crank acceleration (torque + sum of m g . dr/dphi - J' rate^2 / 2) / J, rad/s^2; arguments broadcast.

    torque: on the crank, N m, positive counter-clockwise. Raises NoSolution where the loop does not close or rates do
    not exist, MechlabError if no mass moves.
    """
    g = _gravity(gravity)
    inertia, slope, weights = _reduce(bar, crank_angle)
    _demand_inertia(inertia)
    drive = _finite("torque", torque) + weights @ g
    return np.asarray((drive - 0.5 * slope * _finite("crank_rate", crank_rate) ** 2) / inertia)


def energy_speed(
    bar: MovingFourbar,
    crank_angle: ArrayLike,
    start_angle: float,
    start_rate: float,
    torque: float = 0.0,
    gravity: ArrayLike = NO_GRAVITY,
) -> FloatArray:
    """Crank rate at crank_angle from the energy at the start, with the sign of start_rate, rad/s. (...) -> (...).

    J w^2 / 2 = J_0 w_0^2 / 2 + torque (phi - phi_0) - (V - V_0), exact for a constant torque; angles are not wrapped.
    Raises NoSolution if the energy does not suffice; the angles between are checked every WAY_STEP.
    """
    phi = _finite("crank_angle", crank_angle)
    first = generalised_inertia(bar, start_angle).inertia
    energy0 = potential_energy(bar, start_angle, gravity)

    def square(angle: FloatArray) -> FloatArray:
        inertia = generalised_inertia(bar, angle).inertia
        _demand_inertia(inertia)
        work = torque * (angle - start_angle) - (potential_energy(bar, angle, gravity) - energy0)
        return np.asarray((first * start_rate**2 + 2.0 * work) / inertia)

    low, high = min(phi.min(initial=start_angle), start_angle), max(phi.max(initial=start_angle), start_angle)
    way = np.linspace(low, high, 2 + min(int((high - low) / WAY_STEP), 100_000))
    barrier = square(way) < 0.0
    result = square(phi)
    if barrier.any() or np.any(result < 0.0):
        where = way[barrier][0] if barrier.any() else phi[result < 0.0].flat[0]
        raise NoSolution(
            f"the start energy does not carry the four-bar past the crank angle {where:.6g} rad: "
            "it turns back there. Start faster or ask for nearer angles"
        )
    return np.asarray(math.copysign(1.0, start_rate) * np.sqrt(result))


def _reduce(bar: MovingFourbar, crank_angle: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """J, dJ/dphi and sum of m dr/dphi (..., 2)."""
    phi = _finite("crank_angle", crank_angle)
    motion = _motion(bar, phi).require()
    inertia, slope, weights = np.zeros(phi.shape), np.zeros(phi.shape), np.zeros(phi.shape + (2,))
    for link, base, angle, rate, second in _links(bar, phi, motion):
        arm = _offset(link, angle)
        turned = np.stack([-arm[..., 1], arm[..., 0]], axis=-1)
        r1 = base[1] + rate[..., None] * turned
        r2 = base[2] + second[..., None] * turned - (rate**2)[..., None] * arm
        inertia += link.mass * np.sum(r1 * r1, axis=-1) + link.inertia * rate**2
        slope += 2.0 * (link.mass * np.sum(r1 * r2, axis=-1) + link.inertia * rate * second)
        weights += link.mass * r1
    return inertia, slope, weights


_Base = tuple[FloatArray, FloatArray, FloatArray]


def _links(
    bar: MovingFourbar, phi: FloatArray, motion: FourbarMotion
) -> list[tuple[LinkMass, _Base, FloatArray, FloatArray, FloatArray]]:
    """For each link: mass, its first joint (r, dr/dphi, d2r/dphi2), its angle and the angle's two derivatives."""
    zero = np.zeros(phi.shape + (2,))
    pin = bar.crank * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    pin_slope = np.stack([-pin[..., 1], pin[..., 0]], axis=-1)
    pivot = zero + np.array([bar.ground, 0.0])
    one, nil = np.ones(phi.shape), np.zeros(phi.shape)
    return [
        (bar.crank_mass, (zero, zero, zero), phi, one, nil),
        (bar.coupler_mass, (pin, pin_slope, -pin), motion.coupler_angle, motion.coupler_rate, motion.coupler_accel),
        (bar.rocker_mass, (pivot, zero, zero), motion.rocker_angle, motion.rocker_rate, motion.rocker_accel),
    ]


def _offset(link: LinkMass, angle: FloatArray) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([link.com_along * c - link.com_across * s, link.com_along * s + link.com_across * c], axis=-1)


def _motion(bar: MovingFourbar, phi: FloatArray) -> FourbarMotion:
    return solve(bar.crank, bar.coupler, bar.rocker, bar.ground, phi, 1.0, 0.0, bar.mode)


def _gravity(gravity: ArrayLike) -> FloatArray:
    g = _finite("gravity", gravity)
    if g.shape != (2,):
        raise MechlabError(f"gravity has shape {g.shape}; expected (2,), the vector in the plane, e.g. (0, -9.81)")
    return g


def _demand_inertia(inertia: FloatArray) -> None:
    if np.any(inertia <= 0.0):
        raise MechlabError("the links that move have neither mass nor inertia; expected a mass on at least one of them")


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
