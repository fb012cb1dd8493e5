"""The check of masses, momenta, energy and power: a closed form carries particles along, the engines ask their models.

    state = State(values, rates, solid(mass, centre, ...) + rod(...), points, gravity, freedoms)
    compare([(mechanism, state)])  # a CheckResult

Every rigid part is equimomental to six particles of a sixth of its mass each, at sqrt(3) spread before and behind its centre
along its three principal axes (Routh, Elementary Rigid Dynamics, 1905). Those of a box lie in the middles of its faces; those
of a slender bar at its two ends and four in the middle, which is Simpson's rule. So a check needs no tensor: it says where the
particles are and how fast, and sums.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.protocol import IMPLEMENTATIONS, engine
from mechlab.errors import MechlabError
from mechlab.experiment.entry import CheckResult
from mechlab.experiment.tree_plant import MassShare
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.structure import rank


@dataclass(frozen=True)
class Particles:
    """Masses (n,) [kg], places (n, 3) [m] and velocities (n, 3) [m/s] in world axes. `a + b`: both."""

    mass: Array
    place: Array
    velocity: Array

    def __add__(self, other: Particles) -> Particles:
        pairs = ((self.mass, other.mass), (self.place, other.place), (self.velocity, other.velocity))
        return Particles(*(np.concatenate(pair) for pair in pairs))


NOTHING = Particles(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)))


def solid(
    mass: float, centre: ArrayLike, spread: ArrayLike = (0.0, 0.0, 0.0), axes: ArrayLike = ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    velocity: ArrayLike = (0.0, 0.0, 0.0), turn: ArrayLike = (0.0, 0.0, 0.0),
) -> Particles:  # fmt: skip
    """A rigid part as six particles: `centre` of mass and its `velocity`, `turn` = angular velocity, all (3,) in world axes;
    `spread` (3,) [m]: root mean square distances from the centre along its principal axes, the columns of `axes` (3, 3).
    Without a spread a point mass. Of a box: edge / sqrt(12); of a round section: radius / 2."""
    arms = np.sqrt(3.0) * (np.asarray(axes, dtype=float) * np.asarray(spread, dtype=float)).T
    arms = np.concatenate([arms, -arms])
    around = np.cross(np.asarray(turn, dtype=float), arms)
    return Particles(np.full(6, mass / 6.0), np.asarray(centre) + arms, np.asarray(velocity) + around)


def spread_of(mass: float, moments: Sequence[float]) -> Array:
    """(3,) spread along the principal axes of a part with these three principal moments of inertia [kg m2]."""
    return np.sqrt(np.maximum(0.0, 0.5 * np.sum(moments) - np.asarray(moments, dtype=float)) / mass)


def rod(mass: float, a: ArrayLike, b: ArrayLike, va: ArrayLike, vb: ArrayLike, radius: float = 0.0) -> Particles:
    """A uniform round rod between ends (3,) that move at va, vb, without spin about itself."""
    a, b, va, vb = (np.asarray(x, dtype=float) for x in (a, b, va, vb))
    way = b - a
    length = float(np.linalg.norm(way))
    axes = np.linalg.svd(way[None])[2].T  # the first one along, the others somewhere across
    spread = (length / np.sqrt(12.0), 0.5 * radius, 0.5 * radius)
    turn = np.cross(way, vb - va) / length**2
    return solid(mass, (a + b) / 2.0, spread, axes, (va + vb) / 2.0, turn)


@dataclass(frozen=True)
class State:
    """What a closed form says of a mechanism at one moving state.

    values, rates: of every joint and shaft by name (a quaternion w, x, y, z and the body's angular velocity in its own axes for a
    spherical joint). They set the engines' state; those of shafts are compared, too. particles: everything that has mass and
    moves. points (3,): every frame by name, in the world. gravity (3,). freedoms: of the motion. rotors [J]: kinetic energy of
    armatures and shafts. stored [W]: power that flows into springs; lost [W]: into dampers. poses: body -> rotation (3, 3) and
    origin (3,) in the world, of bodies that carry no mass or whose turn no mass feels. is_reference: this is the reference pose, so
    that all coordinates are zero.
    """

    values: Mapping[str, Any]
    rates: Mapping[str, Any]
    particles: Particles
    points: Mapping[str, ArrayLike]
    gravity: ArrayLike
    freedoms: int
    rotors: float = 0.0
    stored: float = 0.0
    lost: float = 0.0
    poses: Mapping[str, tuple[ArrayLike, ArrayLike]] = field(default_factory=dict)
    is_reference: bool = False


Pair = tuple[Mechanism, State]


def coordinates(m: Mechanism, state: State) -> tuple[Array, Array]:
    """q (nq,) and v (nv,) of the mechanism at the state. Raises MechlabError where the closed form leaves out a name."""
    _complete(m, state)
    q, v = m.reference(), np.zeros(m.nv)
    for j in m.joints:
        zero = j.zero if j.nv == 1 else 0.0
        q[m.q_slice[j.name]] = np.asarray(state.values[j.name], dtype=float) - zero
        v[m.v_slice[j.name]] = state.rates[j.name]
    return q, v


def _complete(m: Mechanism, state: State) -> None:
    for what, needed, given in (
        ("values", {*(j.name for j in m.joints), *m.scalar_names}, state.values),
        ("rates", {*(j.name for j in m.joints), *m.scalar_names}, state.rates),
        ("points", {f.name for f in m.frames}, state.points),
    ):
        lacking = sorted(needed - set(given))
        if lacking:
            raise MechlabError(
                f"{m.name}: the closed form has no {what} of {', '.join(lacking)}; expected {sorted(needed)}."
            )


class Reading(NamedTuple):
    """A moving state as an implementation has it: masses, points of the frames (frames, 3), poses of bodies and of the ground, mass
    matrix (nv, nv), h(q, 0), h(q, v), h(q, -v) (nv,), and of the rows: largest opening, its largest rate, freedoms left."""

    shares: list[MassShare]
    points: Array
    poses: dict[str, tuple[Array, Array]]
    matrix: Array
    still: Array
    ahead: Array
    back: Array
    rows: tuple[float, float, int]


def read(name: str, m: Mechanism, q: Array, v: Array) -> Reading:
    """The state q (nq,), v (nv,) by one of IMPLEMENTATIONS."""
    plant = engine(name).plant(m)
    still, back = (np.array(plant.set(q, s * v).bias()) for s in (0.0, -1.0))
    plant.set(q, v)
    residual, jacobian, rates = plant.closing()
    opening, speed = (float(np.max(np.abs(x), initial=0.0)) for x in (residual, jacobian @ rates))
    poses = {b.name: plant.pose(b.name) for b in m.bodies} | {"ground": (np.eye(3), np.zeros(3))}
    points = np.array([plant.point(f.name) for f in m.frames]).reshape(-1, 3)
    rows = (opening, speed, len(rates) - rank(jacobian))
    return Reading(plant.masses(), points, poses, plant.mass_matrix(), still, np.array(plant.bias()), back, rows)


TEXT = "masses, momenta, energy, power and points of a moving state"
SOURCE = "particles in closed form"


def compare(pairs: Sequence[Pair], tolerance: float = 1e-9) -> CheckResult:
    """Mass, centre of mass, inertia tensor and angular momentum about the world's origin, momentum, kinetic energy, power of
    gravity with springs, power of dampers, points, shafts, opening of loops and relations, freedoms: three implementations
    against closed form, each quantity relative to its size. Raises MechlabError where the closed form leaves out a name."""
    rows: dict[str, list[Array]] = {"expected": [], "numpy": [], "pinocchio": [], "mujoco": []}
    labels: list[str] = []
    for m, state in pairs:
        q, v = coordinates(m, state)
        readings = {name: read(name, m, q, v) for name in IMPLEMENTATIONS}
        truth, sizes = _expected(m, state)
        found_by = {"expected": truth} | {name: _numbers(m, state, q, v, r) for name, r in readings.items()}
        for name, numbers in found_by.items():
            rows[name].append(np.concatenate([np.ravel(numbers[k]) / sizes[k] for k in sizes]))
        labels += [k for k in sizes for _ in range(np.size(truth[k]))]
    values = {k: np.concatenate(x) for k, x in rows.items()}
    expected = values.pop("expected")
    # Sums of some dozens of terms at 1e-16, in poses that a closed form closes to 1e-12: three digits are left.
    found = CheckResult(values, tolerance, expected, f"{len(pairs)} states, each quantity relative to its size")
    if found.passed:
        return found
    wrong: dict[str, dict[str, None]] = {}
    for name, row in values.items():
        for k in np.flatnonzero(~(np.abs(row - expected) <= tolerance)):
            wrong.setdefault(labels[k], {})[name] = None
    sentence = "; ".join(f"{label} ({', '.join(names)})" for label, names in wrong.items())
    return CheckResult(values, tolerance, expected, f"{found.note}. Not so: {sentence}")


def _shafts(m: Mechanism) -> list[str]:
    return [s.name for s in m.shafts]


def _numbers(m: Mechanism, state: State, q: Array, v: Array, r: Reading) -> dict[str, Any]:
    mass = sum(s.mass for s in r.shares)
    first = sum((s.mass * s.centre for s in r.shares), np.zeros(3))
    moved = q - m.reference() if state.is_reference else np.zeros(m.nq)
    angles = np.array([float(m.value(n, q)) for n in _shafts(m)])
    return {
        "mass": mass, "centre of mass": first / max(mass, 1e-300),
        "inertia tensor": sum((s.tensor + _steiner(s.mass, s.centre) for s in r.shares), np.zeros((3, 3))),
        "momentum": sum((s.momentum for s in r.shares), np.zeros(3)),
        "angular momentum": sum((s.spin + cross(s.centre, s.momentum) for s in r.shares), np.zeros(3)),
        "kinetic energy": 0.5 * v @ r.matrix @ v, "power of gravity and springs": v @ r.still,
        "power of dampers": 0.5 * v @ (r.ahead - r.back), "points": r.points,
        "poses of bodies": np.array([np.column_stack(r.poses[n]) for n in state.poses]),
        "shafts": np.concatenate([np.cos(angles), np.sin(angles), [m.row(n) @ v for n in _shafts(m)]]),
        "opening of loops": r.rows[0], "opening rate of loops": r.rows[1], "freedoms": r.rows[2],
        "coordinates": moved,
    }  # fmt: skip


def _expected(m: Mechanism, state: State) -> tuple[dict[str, Any], dict[str, float]]:
    """The same of the particles, and the size of each."""
    mass, x, v = state.particles.mass, state.particles.place, state.particles.velocity
    total, gravity = float(np.sum(mass)), np.asarray(state.gravity, dtype=float)
    away, fast = (float(np.sqrt(mass @ np.sum(z**2, axis=1) / max(total, 1e-300))) for z in (x, v))
    momentum = mass @ v
    angles = np.array([float(state.values[n]) for n in _shafts(m)])
    kinetic = 0.5 * total * fast**2 + state.rotors
    truth: dict[str, Any] = {
        "mass": total, "centre of mass": mass @ x / max(total, 1e-300),
        "inertia tensor": sum((_steiner(k, z) for k, z in zip(mass, x, strict=True)), np.zeros((3, 3))),
        "momentum": momentum, "angular momentum": mass @ np.cross(x, v), "kinetic energy": kinetic,
        "power of gravity and springs": state.stored - gravity @ momentum, "power of dampers": state.lost,
        "points": np.array([state.points[f.name] for f in m.frames], dtype=float).reshape(-1, 3),
        "poses of bodies": np.array([np.column_stack([np.asarray(z) for z in p]) for p in state.poses.values()]),
        "shafts": np.concatenate([np.cos(angles), np.sin(angles), [float(state.rates[n]) for n in _shafts(m)]]),
        "opening of loops": 0.0, "opening rate of loops": 0.0, "freedoms": state.freedoms,
        "coordinates": np.zeros(m.nq),
    }  # fmt: skip
    power = (
        total * fast * (float(np.linalg.norm(gravity)) + fast**2 / max(away, 1e-300)) + abs(state.stored) + state.lost
    )
    sizes = {
        "mass": total, "centre of mass": away, "inertia tensor": total * away**2, "momentum": total * fast,
        "angular momentum": total * away * fast, "kinetic energy": kinetic, "power of gravity and springs": power,
        "power of dampers": power, "points": away, "poses of bodies": 1.0, "opening of loops": away, "opening rate of loops": fast,
        "shafts": max(1.0, float(np.max(np.abs(truth["shafts"]), initial=0.0))), "freedoms": 1.0, "coordinates": 1.0,
    }  # fmt: skip
    return truth, {k: x or 1.0 for k, x in sizes.items()}


def _steiner(mass: float, place: Array) -> Array:
    """(3, 3) tensor about the origin of a mass at a place [kg m2]."""
    return np.asarray(mass * (place @ place * np.eye(3) - np.outer(place, place)))
