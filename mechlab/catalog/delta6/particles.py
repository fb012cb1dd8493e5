"""Check A15: masses, momenta and energy of the delta at moving states, against all its parts as particles.

The particles follow from parameters and closed forms alone, lumped as each fidelity lumps the parts. The head centre moves
on a straight line and the angles turn at constant rates; positions are closed forms of time, velocities and rates their
differences over short times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.catalog.delta6.poses import SHAFT_SENSE, joint_values, random_poses
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit import mass_check
from mechlab.kit.mass_check import NOTHING, Particles, State, solid, spread_of
from mechlab.mechanism.geometry import Array, axis_rotation

X, Y, Z = np.eye(3)
STUB, SPUR = (0.02, (4e-6, 4e-6, 2e-6)), (0.06, (2.2e-5, 2.2e-5, 4e-5))
CENTRAL, PLANET = (0.10, (1.2e-5, 1.2e-5, 2e-5)), (0.08, (1.2e-5, 1.2e-5, 2e-5))
BEVEL = (0.06, (1e-5, 1.5e-5, 1e-5))
CARRIER, TEE = (0.15, (1.5e-4, 1.5e-4, 2e-4)), (0.08, (1e-4, 5e-5, 1e-4))
"""Mass [kg] and principal moments [kg m2] of the parts of the train, written out here and not taken from `masses`, so that a
slip there is seen."""
PLANET_AT, BEVEL_AT = 0.04, 0.03
"""Distances of planets and double bevels from the central axis and the head centre [m]."""


class Snapshot:
    """The delta at one time: values of joints and drives by name, and the rotations that follow from them."""

    def __init__(self, p: Delta6Parameters, fidelity: str, centre: Array, angles: Array) -> None:
        self.p, self.fidelity, self.centre, self.angles = p, fidelity, centre, angles
        self.values = {n: x[0] for n, x in joint_values(p, fidelity, centre, angles).items()}
        alpha, beta, gamma = angles
        self.carrier = axis_rotation(Z, gamma)
        self.tee = self.carrier @ axis_rotation(Y, beta)
        self.output = self.tee @ axis_rotation(X, alpha)
        guides, anchors = p.geometry.guide_positions, p.geometry.platform_anchors
        heights = [float(self.values[f"q{i}"]) - p.slider_height for i in (1, 2, 3)]
        self.upper = [np.array([*u, h]) for u, h in zip(guides, heights, strict=True)]
        self.lower = [centre + a for a in anchors]

    def particles(self) -> Particles:
        """All parts that have mass and move, as the fidelity lumps them."""
        legs = {"minimal": self._lumped_legs, "parts": self._halved_legs, "full": self._whole_legs}[self.fidelity]
        return sum(legs(), NOTHING) + sum(self._head(), NOTHING)

    def _cross(self, at: Array, turned: Array, share: float = 1.0) -> Particles:
        mass = share * self.p.cross_mass
        return solid(mass, at, spread_of(mass, (mass * 0.012**2 / 3.0,) * 3), turned)

    def _rod(self, start: Array, turned: Array, leg: int, mass: float) -> Particles:
        """A rod that lies along its home direction in the axes `turned`."""
        home, a, b = (x[leg] for x in closed.home_axes(self.p.geometry))
        axes = np.column_stack([home, b, np.cross(home, b)])
        spread = np.array([self.p.rod_length / np.sqrt(12.0), 0.5 * self.p.rod_radius, 0.5 * self.p.rod_radius])
        return solid(mass, start + turned @ (0.5 * self.p.rod_length * home), spread, turned @ axes)

    def _ends(self, leg: int) -> Particles:
        """Slider, and stub and cross at both ends of a shaft, that do not turn."""
        return (
            self._slider(leg) + part(STUB, self.upper[leg]) + self._cross(self.upper[leg], np.eye(3))
            + part(STUB, self.lower[leg]) + self._cross(self.lower[leg], np.eye(3))
        )  # fmt: skip

    def _slider(self, leg: int) -> Particles:
        return solid(self.p.slider_mass, self.upper[leg], np.array([0.06, 0.06, 0.08]) / np.sqrt(12.0))

    def _lumped_legs(self) -> Iterator[Particles]:
        homes, _, pins = closed.home_axes(self.p.geometry)
        for k in range(3):
            across = np.cross(homes[k], pins[k])
            turned = axis_rotation(pins[k], float(self.values[f"swing{k + 1}"])) @ axis_rotation(
                across / np.linalg.norm(across), float(self.values[f"sway{k + 1}"])
            )
            yield self._ends(k) + self._rod(self.upper[k], turned, k, 2.0 * self.p.rod_mass) + part(SPUR, self.lower[k])
        for _ in (1, 2):
            yield part(CENTRAL, self.centre)

    def _halved_legs(self) -> Iterator[Particles]:
        half = self.p.rod_mass
        for k in range(3):
            yield self._ends(k) + solid(half, self.upper[k]) + solid(half, self.lower[k])
            yield part(SPUR, self.lower[k], axis_rotation(Z, self._shaft(k)))

    def _whole_legs(self) -> Iterator[Particles]:
        _, forks, pins = closed.home_axes(self.p.geometry)
        for k in range(3):
            i, a, b = k + 1, forks[k], pins[k]
            angle = {n: float(self.values[n]) for n in (f"fork{i}_a", f"fork{i}_b", f"ankle{i}_a", f"ankle{i}_b")}
            stub = axis_rotation(Z, self._shaft(k))
            cross = stub @ axis_rotation(a, angle[f"fork{i}_a"])
            rod = cross @ axis_rotation(b, angle[f"fork{i}_b"])
            yield self._slider(k) + part(STUB, self.upper[k], stub) + self._cross(self.upper[k], cross)
            yield self._rod(self.upper[k], rod, k, self.p.rod_mass)
            yield self._cross(self.lower[k], rod @ axis_rotation(b, angle[f"ankle{i}_b"]), 0.5)
            yield part(STUB, self.lower[k], stub) + part(SPUR, self.lower[k], stub)
            yield self._cross(self.lower[k], stub @ axis_rotation(a, angle[f"ankle{i}_a"]), 0.5)
            beside = self.p.rod_spacing * np.array([*self.p.geometry.tangential_directions[k], 0.0])
            yield self._rod(self.upper[k] + beside, turn_of(self.values[f"ball{i}"]), k, self.p.rod_mass)

    def _shaft(self, leg: int) -> float:
        """Angle of a shaft about Z [rad]."""
        return float(SHAFT_SENSE[leg]) * float(self.values[f"phi{leg + 1}"])

    def _head(self) -> Iterator[Particles]:
        p, o = self.p, self.centre
        plate = 0.25 * 0.08**2  # of a round plate of radius 0.08 m, 0.02 m thick
        yield solid(p.platform_mass, o + p.platform_height * Z, np.sqrt([plate, plate, 0.02**2 / 12.0]))
        yield part(CARRIER, o, self.carrier) + part(TEE, o, self.tee)
        yield part((p.output_mass, (3e-5, 4e-5, 4e-5)), o + p.head_offset * self.output[:, 0], self.output)
        for i, side in ((1, 1.0), (2, -1.0)):
            planet, bevel = o + side * PLANET_AT * self.carrier[:, 1], o + side * BEVEL_AT * self.tee[:, 1]
            if self.fidelity == "minimal":  # the shafts carry the spin about their own axes
                yield part((PLANET[0], (*PLANET[1][:2], 0.0)), planet, self.carrier)
                yield part((BEVEL[0], (BEVEL[1][0], 0.0, BEVEL[1][2])), bevel, self.tee)
                continue
            rho, nu, own = (float(self.values[f"{n}{i}"]) for n in ("rho", "nu", "p"))
            yield part(CENTRAL, o, axis_rotation(Z, rho))
            yield part(PLANET, planet, self.carrier @ axis_rotation(Z, -nu))
            yield part(BEVEL, bevel, self.tee @ axis_rotation(Y, -side * own))


def part(what: tuple[float, tuple[float, ...]], at: Array, turned: Array | None = None) -> Particles:
    """A part of the train by mass and principal moments."""
    mass, moments = what
    return solid(mass, at, spread_of(mass, moments), np.eye(3) if turned is None else turned)


def turn_of(quaternion: Array) -> Array:
    """(3, 3) rotation of a unit quaternion w, x, y, z."""
    w, u = quaternion[0], quaternion[1:]
    return np.asarray((w * w - u @ u) * np.eye(3) + 2.0 * np.outer(u, u) + 2.0 * w * np.cross(np.eye(3), u))


FREEDOMS = {"minimal": 6, "parts": 6, "full": 9}
VELOCITY, TURNING = np.array([0.11, -0.07, 0.09]), np.array([0.9, -0.6, 0.7])
"""Rates of O [m/s] and of alpha, beta, gamma [rad/s]."""
STEP = 1e-3
"""Time step of the central differences [s]. They are of fourth order: for fifth derivatives of size 1 the error is
STEP^4 / 30 = 3e-14, and rounding adds 1e-16 / STEP."""
GRAVITY = (0.0, 0.0, -9.81)


def state(p: Delta6Parameters, fidelity: str, centre: Array, angles: Array) -> State:
    """The delta at a pose, moving at VELOCITY and TURNING."""
    times = (k * STEP for k in (-2, -1, 0, 1, 2))
    before, just, now, soon, then = (Snapshot(p, fidelity, centre + t * VELOCITY, angles + t * TURNING) for t in times)

    def rate(of: Callable[[Snapshot], Array]) -> Array:
        return np.asarray((8.0 * (of(soon) - of(just)) - (of(then) - of(before))) / (12.0 * STEP))

    values: dict[str, Any] = dict(now.values)
    rates: dict[str, Any] = {n: rate(lambda m, n=n: np.asarray(m.values[n])) for n in values}  # type: ignore[misc]
    for n, x in values.items():
        if np.ndim(x):  # angular velocity in the body's axes: twice the vector part of conj(q) q'
            w, u, dw, du = x[0], x[1:], rates[n][0], rates[n][1:]
            rates[n] = 2.0 * (w * du - dw * u - np.cross(u, du))
    shafts = _shafts(p)
    values |= {n: row @ angles for n, (row, _) in shafts.items()}
    rates |= {n: row @ TURNING for n, (row, _) in shafts.items()}
    if fidelity == "minimal":
        energy = 0.5 * sum(moment * float(row @ TURNING) ** 2 for row, moment in shafts.values())
    else:
        armature = p.rotor_inertia + (_spins(p) if fidelity == "parts" else 0.0)
        energy = 0.5 * armature * sum(float(rates[f"phi{i}"]) ** 2 for i in (1, 2, 3))
    parts = now.particles()
    particles = Particles(parts.mass, parts.place, rate(lambda m: m.particles().place))
    points = {"O": centre, "D": centre + p.head_offset * now.output[:, 0]}
    return State(values, rates, particles, points, GRAVITY, FREEDOMS[fidelity], energy)


def _spins(p: Delta6Parameters) -> float:
    """Moment of inertia of two stubs, two crosses and a rod, which turn with a shaft as rotor and gear do [kg m2]."""
    return 2.0 * STUB[1][2] + 2.0 * p.cross_mass * 0.012**2 / 3.0 + 0.5 * p.rod_mass * p.rod_radius**2


def _shafts(p: Delta6Parameters) -> Mapping[str, tuple[Array, float]]:
    """Shaft -> its turns per turn of alpha, beta, gamma (against the base), and its moment of inertia [kg m2]."""
    k, bevel = float(p.k_transfer / p.k_spur), float(p.k_bevel)
    drives, spin = closed.drive_matrix(p.geometry), p.rotor_inertia + _spins(p) + SPUR[1][2]
    rows = {f"phi{i + 1}": (drives[i], spin) for i in range(3)} | {"idler": (np.array([0.0, 0.0, -1.0]), 0.0)}
    for i, sign in ((1, -1.0), (2, 1.0)):
        rows[f"rho{i}"] = (np.array([k * bevel, sign * k, 1.0]), CENTRAL[1][2])
        rows[f"planet{i}_spin"] = (np.array([-bevel, -sign, 1.0]), PLANET[1][2])
        rows[f"bevel{i}_spin"] = (np.array([sign * bevel, 1.0, 0.0]), BEVEL[1][1])
    return rows


def a15(p: Delta6Parameters) -> CheckResult:
    """Two moving states of every fidelity."""
    poses = list(zip(*random_poses(p, 2, seed=17), strict=True))
    pairs = [(build(p, f), state(p, f, c, 0.7 * a)) for f in FREEDOMS for c, a in poses]
    return mass_check.compare(pairs)


A15 = Check("A15", mass_check.TEXT, a15, mass_check.SOURCE)
