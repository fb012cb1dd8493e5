"""The contribution of each part of a train to the mass matrix of the independent rates, if that matrix is constant.

A part adds a term for its spin about its own axis, one for its orbit with its carrier, and rarely a rest. Where the
matrix depends on the pose, `shares` raises an error that names the body and the reason.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.angle_basis import AngleBasis, Row
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body

POSES = 5  # compared: the reference pose and random ones
TOLERANCE = 1e-11
"""Largest change with the pose, relative to the largest entry, that still counts as rounding."""


@dataclass(frozen=True)
class InertiaShare:
    """inertia [kg m2] x row row^T in the mass matrix; `owner`: the body, `kind`: "spin", "orbit" or "rest"."""

    row: Row
    inertia: float
    owner: str
    kind: str


def shares(m: Mechanism, basis: AngleBasis) -> list[InertiaShare]:
    """The shares of all bodies (without armatures and shafts). Every body has one revolute joint.

    T = 1/2 sum of inertia (row . y')^2. A part on a fixed axis: J + m e^2 about it (e: offset of the centre of mass). A
    part of revolution on a carrier: J along its axis with its absolute spin; m R^2 and, for a tilted axis, the moment
    across it with the spin of the carrier. Raises MechlabError that names a body whose share depends on the pose, and
    why.
    """
    rng = np.random.default_rng(5)
    tree = TreeKinematics(m)
    k = basis.matrix
    poses = [m.reference()] + [basis.angles(rng.uniform(-3.0, 3.0, len(basis.independent))) for _ in range(POSES - 1)]
    seen: dict[str, list[tuple[Array, Array]]] = {b.name: [] for b in m.bodies}
    pulls: dict[str, list[Array]] = {b.name: [] for b in m.bodies}
    for q in poses:
        tree.set(q)
        for body in m.bodies:
            block, spin, pull = _of_body(m, tree, body)
            seen[body.name].append((k.T @ block @ k, spin @ k))
            pulls[body.name].append(pull @ k)
    _no_gravity(m, pulls)
    spins: dict[str, Row | None] = {GROUND: None}
    out: list[InertiaShare] = []
    for body in m.bodies:
        first, spin = seen[body.name][0]
        scale = float(np.max(np.abs(first), initial=0.0))
        for block, row in seen[body.name][1:]:
            if np.max(np.abs(block - first), initial=0.0) > TOLERANCE * max(scale, 1e-300):
                raise MechlabError(_why_not_constant(m, body))
            if np.max(np.abs(row - spin), initial=0.0) > TOLERANCE * max(1.0, float(np.max(np.abs(spin)))):
                raise MechlabError(
                    f"{m.name}: the spin of body {body.name!r} about its axis depends on the pose: its carrier tilts. "
                    "An exact reduction needs axes that keep their angles to each other."
                )
        spins[body.name] = exact = _exact_spin(m, basis, body)
        out += _split(body, first, exact, spins[body.parent], scale)
    return out


def _of_body(m: Mechanism, tree: TreeKinematics, body: Body) -> tuple[Array, Array, Array]:
    """J^T m J (nv, nv), the row of its spin about its joint axis (nv,), and the pull of gravity (nv,)."""
    rotation, origin = tree.pose(body.name)
    jacobian = tree.jacobian(body.name, origin + rotation @ np.array(body.inertia.com))
    tensor = rotation @ body.inertia.matrix() @ rotation.T
    block = body.inertia.mass * jacobian[:3].T @ jacobian[:3] + jacobian[3:].T @ tensor @ jacobian[3:]
    axis = tree.axes[m.v_slice[body.joints[0].name].start]
    return block, axis @ jacobian[3:], body.inertia.mass * np.array(m.gravity) @ jacobian[:3]


def _exact_spin(m: Mechanism, basis: AngleBasis, body: Body) -> Row:
    """Spin about the own axis as a row of fractions; cosines within 1e-14 of an integer become that integer."""
    tree = TreeKinematics(m)
    axis = tree.axes[m.v_slice[body.joints[0].name].start]
    row = axis @ tree.jacobian(body.name, np.zeros(3))[3:]
    terms = []
    for name, x in zip(basis.joints, row.tolist(), strict=True):
        c = Fraction(round(x)) if abs(x - round(x)) < 1e-14 else Fraction(x)
        if c:
            terms.append((name, c))
    return basis.combine(tuple(terms))


def _split(body: Body, block: Array, spin: Row, carrier: Row | None, scale: float) -> list[InertiaShare]:
    """block = J spin spin^T + orbit carrier carrier^T + rest, every inertia >= 0."""
    axis = np.array(body.joints[0].axis)
    along = float(axis @ body.inertia.matrix() @ axis)
    s = np.array([float(x) for x in spin])
    out: list[InertiaShare] = []
    rest = block
    if carrier is None:
        along = _fit(block, s)
    if along > 0.0 and np.any(s):
        out.append(InertiaShare(spin, along, body.name, "spin"))
        rest = rest - along * np.outer(s, s)
    if carrier is not None and any(carrier):
        r = np.array([float(x) for x in carrier])
        orbit = _fit(rest, r)
        if orbit > 1e-14 * scale:
            out.append(InertiaShare(carrier, orbit, body.name, "orbit"))
            rest = rest - orbit * np.outer(r, r)
    if np.max(np.abs(rest), initial=0.0) > TOLERANCE * max(scale, 1e-300):
        out += [InertiaShare(row, x, body.name, "rest") for row, x in _triangles(rest)]
    return out


def _fit(block: Array, row: Array) -> float:
    """The x >= 0 for which x row row^T is nearest to the block."""
    size = float(row @ row) ** 2
    return max(0.0, float(row @ block @ row) / size) if size else 0.0


def _triangles(block: Array) -> list[tuple[Row, float]]:
    """A positive semidefinite block as a sum of x row row^T (LDL^T without permutation)."""
    rest, out = block.copy(), []
    top = float(np.max(np.abs(block)))
    for i in range(len(block)):
        d = float(rest[i, i])
        if d <= 1e-15 * top:
            continue
        row = rest[i] / d
        out.append((tuple(Fraction(x) if abs(x) > 1e-300 else Fraction(0) for x in row.tolist()), d))
        rest = rest - d * np.outer(row, row)
    return out


def _no_gravity(m: Mechanism, pulls: dict[str, list[Array]]) -> None:
    """Raise MechlabError when gravity acts on a freedom; bodies are summed, so balanced planets pass."""
    total = np.sum([np.array(p) for p in pulls.values()], axis=0)
    weight = m.total_mass * float(np.linalg.norm(m.gravity))
    largest = float(np.max(np.abs(total), initial=0.0))
    size = float(max((np.max(np.abs(np.array(p)), initial=0.0) for p in pulls.values()), default=0.0))
    if largest <= 1e-12 * weight:  # an offset of 1e-12 m
        return
    worst = max(pulls, key=lambda n: float(np.max(np.abs(np.array(pulls[n])))))
    raise MechlabError(
        f"{m.name}: gravity acts across the axis on body {worst!r}, whose centre of mass moves up and down "
        f"(up to {size:.3g} N m): shafts carry no weight. Balance it, turn gravity along the axes, set it to 0, or keep "
        "the fidelity with bodies."
    )


def _why_not_constant(m: Mechanism, body: Body) -> str:
    axis, com = np.array(body.joints[0].axis), np.array(body.inertia.com)
    offset = float(np.linalg.norm(com - (com @ axis) * axis))
    turned = body.inertia.matrix() @ axis
    slanted = float(np.linalg.norm(turned - (axis @ turned) * axis))
    start = f"{m.name}: the inertia of body {body.name!r} is not constant: "
    if offset > 1e-12:
        reason = f"its centre of mass stands {offset:.3g} m off its own axis while the axis orbits"
    elif slanted > 1e-12 * float(np.abs(body.inertia.matrix()).max()) or not _round(body):
        reason = (
            "its axis is not parallel to that of its carrier and its inertia is not rotationally symmetric about it"
        )
    else:
        reason = "its axis moves on a path that is no circle about one fixed axis (a carrier on a carrier)"
    return f"{start}{reason}. There is no exact reduction; simulate it with bodies, or make the part balanced."


def _round(body: Body) -> bool:
    """True when the inertia is the same about every axis across that of the joint."""
    axis = np.array(body.joints[0].axis)
    values = np.sort(
        np.linalg.eigvalsh(body.inertia.matrix() - (axis @ body.inertia.matrix() @ axis) * np.outer(axis, axis))
    )
    return bool(abs(values[2] - values[1]) <= 1e-12 * max(abs(values[2]), 1e-300))
