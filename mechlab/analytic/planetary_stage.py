"""One epicyclic stage: sun, N planets on a carrier, ring. Lossless, planets evenly spaced.

Speeds are absolute, positive in one common sense. Willis: z_s w_s + z_r w_r = (z_s + z_r) w_c.
"""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class StageSpeeds:
    """Absolute speeds, rad/s (or angles, or accelerations: the law is the same)."""

    sun: FloatArray
    ring: FloatArray
    carrier: FloatArray
    planet: FloatArray


@dataclass(frozen=True)
class StageTorques:
    """External torques on the three members in steady motion, N m; their sum is zero."""

    sun: FloatArray
    ring: FloatArray
    carrier: FloatArray


@dataclass(frozen=True)
class StageAccelerations:
    """Absolute accelerations, rad/s^2; ring_torque: external torque on the ring, N m (it holds a held ring)."""

    sun: FloatArray
    ring: FloatArray
    carrier: FloatArray
    planet: FloatArray
    ring_torque: FloatArray


@dataclass(frozen=True)
class AssemblyConditions:
    """coaxial: ring = sun + 2 planet. even: (sun + ring) / planets is whole. neighbours: tips of planets do not meet;
    neighbour_margin is the clearance in modules, (sun + planet) sin(pi / planets) - planet - 2."""

    coaxial: bool
    even: bool
    neighbours: bool
    neighbour_margin: float


@dataclass(frozen=True)
class PlanetaryStage:
    """Tooth counts, number of planets and inertias (kg m^2) of a stage.

    planet_inertia: one planet about its own axis; planet_mass [kg] of one planet, its centre at orbit_radius [m];
    carrier_inertia is that of the carrier without planets. Raises MechlabError for tooth counts that are not positive
    or values that are negative.
    """

    sun_teeth: int
    planet_teeth: int
    ring_teeth: int
    planets: int
    sun_inertia: float
    planet_inertia: float
    ring_inertia: float
    carrier_inertia: float
    planet_mass: float
    orbit_radius: float

    def __post_init__(self) -> None:
        _teeth(
            sun_teeth=self.sun_teeth, planet_teeth=self.planet_teeth, ring_teeth=self.ring_teeth, planets=self.planets
        )
        for field in fields(self)[4:]:
            value = getattr(self, field.name)
            if not math.isfinite(value) or value < 0.0:
                raise MechlabError(f"{field.name} = {value!r}; expected a finite number, zero or more")


def conditions(sun_teeth: int, planet_teeth: int, ring_teeth: int, planets: int) -> AssemblyConditions:
    """Whether standard gears (addendum one module) can be put together as one stage."""
    _teeth(sun_teeth=sun_teeth, planet_teeth=planet_teeth, ring_teeth=ring_teeth, planets=planets)
    margin = float(neighbour_margin(sun_teeth, planet_teeth, planets))
    return AssemblyConditions(
        ring_teeth == sun_teeth + 2 * planet_teeth, (sun_teeth + ring_teeth) % planets == 0, margin >= TOUCHING, margin
    )


TOUCHING = -1e-9
"""Margin of neighbours that touch: sin(pi / 6) is not exactly 1/2, and an exact touch must not depend on its last bit."""


def neighbour_margin(sun_teeth: ArrayLike, planet_teeth: ArrayLike, planets: int) -> FloatArray:
    """Clearance between the tips of neighbouring planets [modules], (sun + planet) sin(pi / planets) - planet - 2; inf for one."""
    sun, planet = np.asarray(sun_teeth, dtype=float), np.asarray(planet_teeth, dtype=float)
    return np.asarray((sun + planet) * math.sin(math.pi / planets) - planet - 2.0 if planets > 1 else np.full(sun.shape, math.inf))


def speeds(
    sun_teeth: int,
    ring_teeth: int,
    *,
    sun: ArrayLike | None = None,
    ring: ArrayLike | None = None,
    carrier: ArrayLike | None = None,
    planet_teeth: float | None = None,
) -> StageSpeeds:
    """The third speed and the planet's from exactly two of sun, ring, carrier; arrays broadcast.

    w_p = w_c - (z_s / z_p) (w_s - w_c); planet_teeth defaults to (ring_teeth - sun_teeth) / 2.
    Raises MechlabError unless exactly two speeds are given.
    """
    _teeth(sun_teeth=sun_teeth, ring_teeth=ring_teeth)
    zp = 0.5 * (ring_teeth - sun_teeth) if planet_teeth is None else planet_teeth
    if zp <= 0:
        raise MechlabError(f"planet_teeth = {zp!r}; expected a positive number (ring_teeth greater than sun_teeth)")
    given = {"sun": sun, "ring": ring, "carrier": carrier}
    known = {name: _finite(name, value) for name, value in given.items() if value is not None}
    if len(known) != 2:
        raise MechlabError(
            f"{len(known)} speeds given ({', '.join(known) or 'none'}); expected exactly two of sun, ring, carrier"
        )
    zs, zr = float(sun_teeth), float(ring_teeth)
    if "carrier" not in known:
        known["carrier"] = (zs * known["sun"] + zr * known["ring"]) / (zs + zr)
    elif "sun" not in known:
        known["sun"] = ((zs + zr) * known["carrier"] - zr * known["ring"]) / zs
    else:
        known["ring"] = ((zs + zr) * known["carrier"] - zs * known["sun"]) / zr
    ws, wr, wc = np.broadcast_arrays(known["sun"], known["ring"], known["carrier"])
    return StageSpeeds(ws, wr, wc, np.asarray(wc - zs / zp * (ws - wc)))


def balance(
    sun_teeth: int,
    ring_teeth: int,
    *,
    sun: ArrayLike | None = None,
    ring: ArrayLike | None = None,
    carrier: ArrayLike | None = None,
) -> StageTorques:
    """Steady torques from exactly one of them: sun : ring : carrier = z_s : z_r : -(z_s + z_r)."""
    _teeth(sun_teeth=sun_teeth, ring_teeth=ring_teeth)
    shares = {"sun": float(sun_teeth), "ring": float(ring_teeth), "carrier": -float(sun_teeth + ring_teeth)}
    known = {name: value for name, value in (("sun", sun), ("ring", ring), ("carrier", carrier)) if value is not None}
    if len(known) != 1:
        raise MechlabError(
            f"{len(known)} torques given ({', '.join(known) or 'none'}); expected exactly one of sun, ring, carrier"
        )
    ((name, value),) = known.items()
    unit = _finite(name, value) / shares[name]
    return StageTorques(unit * shares["sun"], unit * shares["ring"], unit * shares["carrier"])


def mass_matrix(stage: PlanetaryStage) -> FloatArray:
    """M of T = v' M v / 2 in v = (sun speed, carrier speed), ring free; constant, kg m^2, shape (2, 2).

    M = diag(J_s, J_c + N m_p R^2) + N J_p p p' + J_r r r', p = (-z_s/z_p, 1 + z_s/z_p), r = (-z_s/z_r, 1 + z_s/z_r).
    """
    p, r = _rows(stage)
    orbit = stage.carrier_inertia + stage.planets * stage.planet_mass * stage.orbit_radius**2
    return np.asarray(
        np.diag([stage.sun_inertia, orbit])
        + stage.planets * stage.planet_inertia * np.outer(p, p)
        + stage.ring_inertia * np.outer(r, r)
    )


def kinetic_energy(stage: PlanetaryStage, sun: ArrayLike, carrier: ArrayLike) -> FloatArray:
    """T [J] from the speeds of sun and carrier [rad/s], which broadcast."""
    v = np.stack(np.broadcast_arrays(_finite("sun", sun), _finite("carrier", carrier)), axis=-1)
    return np.asarray(0.5 * np.sum(v * (v @ mass_matrix(stage)), axis=-1))


def free_accelerations(
    stage: PlanetaryStage, sun_torque: ArrayLike = 0.0, carrier_torque: ArrayLike = 0.0, ring_torque: ArrayLike = 0.0
) -> StageAccelerations:
    """Accelerations with nothing held (two freedoms): M v' = (T_s, T_c) + T_r r. Torques broadcast.

    Raises MechlabError if M is singular (a freedom without inertia).
    """
    ts, tc, tr = np.broadcast_arrays(
        *(
            _finite(n, t)
            for n, t in (("sun_torque", sun_torque), ("carrier_torque", carrier_torque), ("ring_torque", ring_torque))
        )
    )
    m = mass_matrix(stage)
    det = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    if det <= 1e-15 * m[0, 0] * m[1, 1]:
        raise MechlabError("a freedom of the stage has no inertia; expected inertias that leave M positive definite")
    p, r = _rows(stage)
    qs, qc = ts + tr * r[0], tc + tr * r[1]
    sun = (m[1, 1] * qs - m[0, 1] * qc) / det
    carrier = (m[0, 0] * qc - m[1, 0] * qs) / det
    return StageAccelerations(
        np.asarray(sun),
        np.asarray(r[0] * sun + r[1] * carrier),
        np.asarray(carrier),
        np.asarray(p[0] * sun + p[1] * carrier),
        np.asarray(tr),
    )


def held_ring_accelerations(
    stage: PlanetaryStage, sun_torque: ArrayLike = 0.0, carrier_torque: ArrayLike = 0.0
) -> StageAccelerations:
    """Accelerations with the ring held (one freedom): (T_c + i T_s) / J, i = 1 + z_r/z_s.

    J = i^2 J_s + J_c + N m_p R^2 + N J_p (1 - z_r/z_p)^2. Torques broadcast; `ring_torque` of the
    result holds the ring. Raises MechlabError if J is zero.
    """
    ts, tc = np.broadcast_arrays(_finite("sun_torque", sun_torque), _finite("carrier_torque", carrier_torque))
    m = mass_matrix(stage)
    p, r = _rows(stage)
    ratio = 1.0 + stage.ring_teeth / stage.sun_teeth
    along = np.array([ratio, 1.0])
    inertia = float(along @ m @ along)
    if inertia <= 0.0:
        raise MechlabError("no part that moves has inertia; expected at least one inertia greater than zero")
    carrier = (tc + ratio * ts) / inertia
    hold = (m[0] @ along * carrier - ts) / r[0]
    return StageAccelerations(
        np.asarray(ratio * carrier),
        np.zeros(carrier.shape),
        np.asarray(carrier),
        np.asarray(float(p @ along) * carrier),
        np.asarray(hold),
    )


def _rows(stage: PlanetaryStage) -> tuple[FloatArray, FloatArray]:
    """Planet and ring speed as rows over (sun, carrier)."""
    planet, ring = stage.sun_teeth / stage.planet_teeth, stage.sun_teeth / stage.ring_teeth
    return np.array([-planet, 1.0 + planet]), np.array([-ring, 1.0 + ring])


def _teeth(**counts: int) -> None:
    for name, value in counts.items():
        if not math.isfinite(value) or value != int(value) or value < 1:
            raise MechlabError(f"{name} = {value!r}; expected a whole number, 1 or more")


def _finite(name: str, value: ArrayLike) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    if not np.all(np.isfinite(array)):
        raise MechlabError(f"{name} holds values that are not finite; expected finite numbers")
    return array
