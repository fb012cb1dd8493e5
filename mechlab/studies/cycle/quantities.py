"""Quantities along a cycle: drive force and reactions, shaking force and moment, instant centres, transmission, extrema.

Forces are computed by Pinocchio and, at a few positions, by MuJoCo for comparison; the others follow from kinematics alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from mechlab.engines.own.closed_path import PathPoint
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import GROUND, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import is_length
from mechlab.mechanism.many_motion import ManyMotion
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.parts import FORCES, MOMENTS

COMPARED = 9


@dataclass(frozen=True)
class ReactionTable:
    """Reactions at n positions: columns name -> (n,) with their units; forces: loop or joint -> (n, 6) force [N] and
    moment [N m]; drive: force of the drive (n,) [N or N m]."""

    columns: dict[str, Array]
    units: dict[str, str]
    forces: dict[str, Array]
    drive: Array


def reactions(m: Mechanism, drive: str, accel: float, q: Array, v: Array, load: Array) -> ReactionTable:
    """Force of the drive and the wrenches of loops (on body b) and joints (on the body from its parent, about the
    joint), world axes, of the motion q (n, nq), v (n, nv) under the constant load (nv,)."""
    found = engine("pinocchio").motion_forces(m, q, v, drive, accel, load)
    forces = {**found.loops, **found.joints}
    columns = {f"{drive}_force": found.drive}
    units = {f"{drive}_force": "N" if is_length(m, drive) else "N m"}
    for relation in m.relations:
        columns[f"{relation.name}_load"] = found.relations[relation.name]
        units[f"{relation.name}_load"] = "N" if relation.coefficients[0][0] in m.slides else "N m"
    for curve in m.curves:
        columns[f"{curve.name}_load"] = found.relations[curve.name]
        units[f"{curve.name}_load"] = "N" if curve.output in m.slides else "N m"
    for name, table in forces.items():
        key = name if f"{name}_fx" not in columns else f"{name}_joint"
        for k, part in enumerate((*FORCES, *MOMENTS)):
            columns[f"{key}_{part}"] = table[:, k]
            units[f"{key}_{part}"] = "N" if k < 3 else "N m"
        columns[f"{key}_reaction"] = np.linalg.norm(table[:, :3], axis=1)
        units[f"{key}_reaction"] = "N"
    return ReactionTable(columns, units, forces, found.drive)


def witness_difference(
    m: Mechanism, drive: str, accel: float, q: Array, v: Array, load: Array, found: ReactionTable
) -> float:
    """Largest difference of drive force, loop forces and joint wrenches [N, N m] from those of MuJoCo, at nine
    positions.

    For a body with several joints only the last is compared. Raises MechlabError where MuJoCo cannot compute them.
    """
    some = np.unique(np.linspace(0, len(q) - 1, COMPARED).astype(int))
    theirs = engine("mujoco").motion_forces(m, q[some], v[some], drive, accel, load)
    gaps = [float(np.max(np.abs(theirs.drive - found.drive[some])))]
    gaps += [float(np.max(np.abs(f[:, :3] - found.forces[n][some, :3]))) for n, f in theirs.loops.items()]
    gaps += [float(np.max(np.abs(w - found.forces[n][some]))) for n, w in theirs.joints.items()]
    return max(0.0, *gaps)


MANY = 7
"""With more moving bodies than this, only the instant centres relative to the ground are given."""


def shaking(m: Mechanism, q: Array, v: Array, a: Array) -> tuple[Array, Array]:
    """(n, 3) force [N] and (n, 3) moment [N m] about the world's origin that the inertia of all bodies exerts on the
    ground: minus the rates of momentum and angular momentum. Weight is not in it; shafts and armatures are not."""
    force, moment = np.zeros((len(q), 3)), np.zeros((len(q), 3))
    poses = ManyPoses(m).set(q)
    moving, gaining = ManyMotion(poses, v), ManyMotion(poses, a)
    for body in (b for b in m.bodies if b.inertia.mass > 0.0):
        rotation, origin = poses.frame(body.name)
        com = origin + rotation @ np.array(body.inertia.com)
        velocity, bias = moving.point(body.name, com)
        motion = bias + gaining.point(body.name, com)[0]
        tensor = rotation @ body.inertia.matrix() @ rotation.transpose(0, 2, 1)
        spin = velocity[:, 3:]
        momentum, gain = (np.einsum("kij,kj->ki", tensor, x) for x in (spin, motion[:, 3:]))
        f = body.inertia.mass * motion[:, :3]
        force -= f
        moment -= np.cross(com, f) + gain + np.cross(spin, momentum)
    return force, moment


def planar_normal(m: Mechanism, pose: PathPoint) -> Array | None:
    """Normal (3,) of a planar mechanism, None for a spatial one."""
    tree = TreeKinematics(m, pose.q)
    turning = tree.axes[tree.turns > 0]
    if not len(turning) or any(j.kind == "spherical" for j in m.joints):
        return None
    n = turning[0]
    across = tree.axes[tree.turns == 0] @ n
    planar = np.all(np.abs(np.abs(turning @ n) - 1.0) < 1e-12) and np.all(np.abs(across) < 1e-12)
    return n if planar else None


def instant_centres(m: Mechanism, poses: Sequence[PathPoint], normal: Array) -> dict[str, Array]:
    """centre_A_B_x, _y, _z (n,) [m]: the instant centre of body B relative to A, for all pairs of bodies.

    With more than MANY moving bodies A is always the ground. The centre lies in the plane of motion through the world's
    origin; NaN where the pair has no relative rotation (centre at infinity).
    """
    moving = [b.name for b in m.bodies if b.joints]
    names = [GROUND, *moving]
    pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]
    if len(moving) > MANY:
        pairs = [(GROUND, b) for b in moving]
    motion = ManyMotion(ManyPoses(m).set(np.array([p.q for p in poses])), np.array([p.u for p in poses]))
    twist = {n: motion.point(n, np.zeros((len(poses), 3)))[0] for n in names}
    fastest = np.max([np.linalg.norm(t[:, 3:], axis=1) for t in twist.values()], axis=0)
    out: dict[str, Array] = {}
    for a, b in pairs:
        relative = twist[b] - twist[a]
        w = relative[:, 3:] @ normal
        turning = np.abs(w) > 1e-9 * np.maximum(fastest, 1e-300)
        place = np.full((len(poses), 3), np.nan)
        place[turning] = np.cross(normal, relative[turning, :3]) / w[turning, None]
        out |= {f"centre_{a}_{b}_{x}": place[:, i] for i, x in enumerate("xyz")}
    return out


POINT_LOOPS = ("spherical", "revolute")


def outputs(m: Mechanism, drive: str, poses: Sequence[PathPoint], named: str | None) -> str | None:
    """The output joint of the transmission: the named one; else the last joint on the ground that moves and is not the
    drive; else None. Raises MechlabError for a name that does not exist, does not move, or is the drive."""
    moves = {n: any(abs(m.row(n) @ p.u) > 1e-9 for p in poses) for n in m.scalar_names}
    if named is not None:
        m.row(named)
        if not moves[named] or named == drive:
            raise MechlabError(
                f"{m.name}: output {named!r} must be a joint that moves, other than the drive {drive!r}."
            )
        return named
    grounded = [j.name for b in m.bodies if b.parent == GROUND for j in b.joints if j.nv == 1 and j.name != drive]
    found = [n for n in grounded if moves[n]]
    return found[-1] if found else None


TRANSMITTED = ("velocity_ratio", "mechanical_advantage", "_transmission_angle")
"""Ends of the columns of `transmission`."""


def transmission(
    m: Mechanism, drive: str, output: str, poses: Sequence[PathPoint]
) -> tuple[dict[str, Array], dict[str, str]]:
    """velocity_ratio d(output)/d(drive), mechanical_advantage (load on the output per force of the drive, its inverse),
    and LOOP_transmission_angle (n,) in [0, pi/2] for each loop that is a pin.

    The angle is pi/2 less the angle between the loop force and the velocity of its point, with a load on the output
    alone (no mass, no weight). In a four-bar it is the angle between coupler and rocker. NaN where the loop carries no
    force or its point does not move.
    """
    q, u = np.array([p.q for p in poses]), np.array([p.u for p in poses])
    ratio = np.array([float(m.row(output) @ p.u) for p in poses])
    loads = engine("pinocchio").loop_loads(m, q, u, m.row(output) - np.outer(ratio, m.row(drive)))
    angles: dict[str, Array] = {}
    for loop in (x for x in m.loops if x.kind in POINT_LOOPS):
        force, velocity = loads.force[loop.name], loads.velocity[loop.name]
        sizes = np.linalg.norm(force, axis=1) * np.linalg.norm(velocity, axis=1)
        loaded = sizes > 1e-12
        angles[loop.name] = np.full(len(poses), np.nan)
        cosine = np.abs(np.einsum("ij,ij->i", force, velocity)[loaded]) / sizes[loaded]
        angles[loop.name][loaded] = np.arcsin(np.minimum(1.0, cosine))
    with np.errstate(divide="ignore"):
        advantage = 1.0 / ratio
    columns = {"velocity_ratio": ratio, "mechanical_advantage": advantage}
    units = {"velocity_ratio": "", "mechanical_advantage": ""}
    for name, values in angles.items():
        columns[f"{name}_transmission_angle"], units[f"{name}_transmission_angle"] = values, "rad"
    return columns, units


GUIDES = 1e-9
"""A pin passes nothing on where its transmission angle [rad] is below this all along the path."""


def without_guides(columns: dict[str, Array]) -> dict[str, Array]:
    """The columns of `transmission` along a path, NaN for the pins of links that only guide: their force is always normal to the
    motion, so that no share of the load passes (in Stephenson's six-bar the rocker, where the load is on the second dyad)."""
    return {n: np.full_like(x, np.nan) if n.endswith("_angle") and not np.any(x > GUIDES) else x for n, x in columns.items()}


FINE = 1e-7
"""Width at which the search for an extremum ends, relative to the interval searched. The value is then exact to
rounding at a smooth extremum; at a kink its error is this share of the change between samples."""


@dataclass(frozen=True)
class Extremum:
    """A largest or least value, and the position where it occurs."""

    value: float
    at: float


def extremum(
    positions: Array, values: Array, sign: int, function: Callable[[float], float] | None = None, closed: bool = False
) -> Extremum | None:
    """The largest (sign 1) or least (-1) value; None where no sample is finite.

    positions, values (n,): samples, NaN where there is no value. function(position): the curve between them. Where it
    is given, every local extremum of the samples is refined between its neighbours (Brent's method), unless adding
    twice its lead over a neighbour would still not make it the best. closed: the last sample repeats the first
    (periodic curve).
    """
    x, y = np.asarray(positions, dtype=float), sign * np.asarray(values, dtype=float)
    if not np.isfinite(y).any():
        return None
    y = np.where(np.isfinite(y), y, -np.inf)
    best = int(np.argmax(y))
    found = Extremum(float(sign * y[best]), float(x[best]))
    if function is None or len(x) < 3 or np.ptp(y[np.isfinite(y)]) <= 1e-13 * max(1.0, abs(y[best])):
        return found
    period = x[-1] - x[0]
    if closed:
        x, y = np.concatenate([[x[-2] - period], x, [x[1] + period]]), np.concatenate([[y[-2]], y, [y[1]]])
    inner = np.arange(1, len(x) - 1)
    top = inner[(y[inner] >= y[inner - 1]) & (y[inner] >= y[inner + 1]) & np.isfinite(y[inner])]
    top = top[~np.isneginf(y[top - 1]) | ~np.isneginf(y[top + 1])]
    if not closed:  # where an end sample leads, the extremum may lie between it and its neighbour
        top = np.union1d(top, [k for k in (1, len(x) - 2) if y[0 if k == 1 else -1] >= y[k] > -np.inf]).astype(int)
    for k in top[np.argsort(-y[top])]:
        leads = [d for d in (abs(y[k] - y[k - 1]), abs(y[k] - y[k + 1])) if np.isfinite(d)]
        if y[k] + 2.0 * max(leads, default=0.0) < sign * found.value:
            continue
        here = _climb(lambda p: sign * function(p), float(x[k - 1]), float(x[k + 1]))
        if here.value > sign * found.value:
            at = here.at + (period if closed and here.at < positions[0] else 0.0)
            found = Extremum(sign * here.value, at - (period if closed and at > positions[-1] else 0.0))
    return found


def _climb(function: Callable[[float], float], low: float, high: float) -> Extremum:
    """The largest finite value between two positions."""

    def cost(p: float) -> float:
        value = float(function(p))
        return -value if np.isfinite(value) else np.inf

    done = minimize_scalar(
        cost, bounds=(low, high), method="bounded", options={"xatol": FINE * (high - low), "maxiter": 60}
    )
    return Extremum(-float(done.fun), float(done.x))
