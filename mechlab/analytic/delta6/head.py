"""Dynamics of the orientation head with O held, in the angles v = (alpha', beta', gamma').

T = v' M(beta) v / 2 with M = sum of J r r' over the rotating parts; the output link is a body of revolution, so M
depends on beta alone. Equation of motion: M v' + bias + gravity = Q, Q = K' (torques of the three rotary drives).
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6.geometry import Delta6, FloatArray, apply, finite, number, vectors
from mechlab.analytic.delta6.rotation import drive_matrix
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class HeadInertias:
    """Inertias (kg m^2), masses (kg) and axis offsets (m) of the head. All defaults are assumed; the source gives none.

    output_axial Ja and output_transverse Jt: output link about X' and across it at O, including mass * offset^2.
    tee_x, tee_y, tee_z: T-shaped carrier in its own axes at O. carrier_z: head carrier about Z. bevel_axial,
    bevel_transverse, bevel_mass, bevel_offset: one double bevel, about its axis Y and across it at its centre, +-offset
    along Y. planet_axial, planet_mass, planet_offset: one planet with its input bevel, axis parallel Z at y = +-offset.
    transfer_gear: one loose gear on the central axis. input_gear: one input gear with its rotor. third_shaft: shaft 3
    with its rotor. planet_sense: +1 for the source's signs, in which every spur mesh keeps the sense of rotation, -1 for
    real external meshes, where the planets turn against the carrier. Raises MechlabError for a value that is negative
    or not finite, or a sense other than +-1.
    """

    output_axial: float = 3e-5
    output_transverse: float = 4.15e-4
    tee_x: float = 1e-4
    tee_y: float = 5e-5
    tee_z: float = 1e-4
    carrier_z: float = 2e-4
    bevel_axial: float = 1.5e-5
    bevel_transverse: float = 1e-5
    bevel_mass: float = 0.06
    bevel_offset: float = 0.03
    planet_axial: float = 2e-5
    planet_mass: float = 0.08
    planet_offset: float = 0.04
    transfer_gear: float = 2e-5
    input_gear: float = 2.04e-3
    third_shaft: float = 2.04e-3
    planet_sense: int = 1

    def __post_init__(self) -> None:
        if self.planet_sense not in (-1, 1):
            raise MechlabError(f"planet_sense = {self.planet_sense!r}; expected +1 or -1")
        for field in fields(self):
            if field.name != "planet_sense" and number(field.name, getattr(self, field.name)) < 0.0:
                raise MechlabError(f"{field.name} = {getattr(self, field.name)!r}; expected zero or more")

    @property
    def bevel_about_tee(self) -> float:
        """One double bevel across its axis, at O."""
        return self.bevel_transverse + self.bevel_mass * self.bevel_offset**2


def mass_matrix(geom: Delta6, inertias: HeadInertias, beta: ArrayLike) -> FloatArray:
    """M(beta) in kg m^2. (...) -> (..., 3, 3), symmetric, order alpha, beta, gamma."""
    be = finite("beta", beta)
    s, c = np.sin(be), np.cos(be)
    j = inertias
    m = np.empty(be.shape + (3, 3))
    m[...] = _constant_part(geom, j)
    m[..., 0, 0] += j.output_axial
    m[..., 0, 2] -= j.output_axial * s
    m[..., 2, 0] -= j.output_axial * s
    m[..., 2, 2] += _about_x(j) * s * s + _about_z(j) * c * c
    return m


def mass_matrix_slope(inertias: HeadInertias, beta: ArrayLike) -> FloatArray:
    """dM / d beta. (...) -> (..., 3, 3)."""
    be = finite("beta", beta)
    s, c = np.sin(be), np.cos(be)
    slope = np.zeros(be.shape + (3, 3))
    slope[..., 0, 2] = slope[..., 2, 0] = -inertias.output_axial * c
    slope[..., 2, 2] = 2.0 * s * c * (_about_x(inertias) - _about_z(inertias))
    return slope


def bias(inertias: HeadInertias, beta: ArrayLike, rates: ArrayLike) -> FloatArray:
    """M' v beta' - (0, v' M' v / 2, 0), N m. beta (...), rates v (..., 3) -> (..., 3)."""
    v = vectors("rates", rates)
    slope = mass_matrix_slope(inertias, beta)
    turned = apply(slope, v)
    result = turned * v[..., 1:2]
    result[..., 1] -= 0.5 * np.sum(v * turned, axis=-1)
    return result


def gravity(beta: ArrayLike, mass: float, arm: float, acceleration: float = 9.81) -> FloatArray:
    """Left-hand term dV / d(angles) = (0, -m g arm cos(beta), 0) of a mass `arm` along e1 from O. (...) -> (..., 3).

    V = -m g arm sin(beta): gravity itself drives beta with +m g arm cos(beta).
    """
    be = finite("beta", beta)
    term = np.zeros(be.shape + (3,))
    term[..., 1] = -mass * acceleration * arm * np.cos(be)
    return term


def generalized_forces(geom: Delta6, torques: ArrayLike) -> FloatArray:
    """Q = K' torques: forces on alpha, beta, gamma from the rotary drives, (..., 3) -> (..., 3), N m."""
    return apply(drive_matrix(geom).T, vectors("torques", torques))


def drive_torques(
    geom: Delta6,
    inertias: HeadInertias,
    beta: ArrayLike,
    rates: ArrayLike,
    accelerations: ArrayLike,
    gravity_term: ArrayLike = (0.0, 0.0, 0.0),
) -> FloatArray:
    """Torques of the rotary drives for a motion with O held: K'^-1 (M v' + bias + gravity), (..., 3), N m.

    gravity_term: what `gravity` returns; zero by default, as in the source.
    """
    forces = (
        apply(mass_matrix(geom, inertias, beta), vectors("accelerations", accelerations))
        + bias(inertias, beta, rates)
        + vectors("gravity_term", gravity_term)
    )
    return np.asarray(np.linalg.solve(drive_matrix(geom).T, forces[..., None])[..., 0])


def angle_accelerations_from_torques(
    geom: Delta6,
    inertias: HeadInertias,
    beta: ArrayLike,
    rates: ArrayLike,
    torques: ArrayLike,
    gravity_term: ArrayLike = (0.0, 0.0, 0.0),
) -> FloatArray:
    """v' = M^-1 (K' torques - bias - gravity) with O held, (..., 3), rad/s^2."""
    right = generalized_forces(geom, torques) - bias(inertias, beta, rates) - vectors("gravity_term", gravity_term)
    return np.asarray(np.linalg.solve(mass_matrix(geom, inertias, beta), right[..., None])[..., 0])


def _about_x(j: HeadInertias) -> float:
    """Parts turning with T about its x axis, for a rate gamma' only: they see -sin(beta) gamma'."""
    return j.output_axial + j.tee_x + 2.0 * j.bevel_about_tee


def _about_z(j: HeadInertias) -> float:
    """Parts turning with T about its z axis, for a rate gamma' only: they see cos(beta) gamma'."""
    return j.output_transverse + j.tee_z + 2.0 * j.bevel_about_tee


def _constant_part(geom: Delta6, j: HeadInertias) -> FloatArray:
    """Sum of J r r' over the parts whose row r does not depend on beta."""
    planet_ratio, bevel_ratio, spur = geom.k_transfer / geom.k_spur, geom.k_bevel, geom.k_spur
    parts: list[tuple[float, tuple[float, float, float]]] = [
        (j.output_transverse + j.tee_y, (0.0, 1.0, 0.0)),
        (j.carrier_z + 2.0 * j.planet_mass * j.planet_offset**2 + j.third_shaft, (0.0, 0.0, 1.0)),
    ]
    for sign in (-1.0, 1.0):
        transfer = (planet_ratio * bevel_ratio, sign * planet_ratio, 1.0)
        parts += [
            (j.bevel_axial, (sign * bevel_ratio, 1.0, 0.0)),
            (j.planet_axial, (j.planet_sense * bevel_ratio, j.planet_sense * sign, 1.0)),
            (j.transfer_gear, transfer),
            (j.input_gear, (spur * transfer[0], spur * transfer[1], spur)),
        ]
    rows = np.array([row for _, row in parts])
    return np.asarray((rows.T * [inertia for inertia, _ in parts]) @ rows)
