"""Checks that every Mechanism passes when it is made. Each failure is one MechlabError that names the culprit."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from fractions import Fraction

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Vector, unit, vector
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.length_unit import row_units
from mechlab.mechanism.model import CHECKS, Mechanism
from mechlab.mechanism.naming import refuse_collisions
from mechlab.mechanism.parts import (
    GROUND,
    JOINT_KINDS,
    LOOP_ROWS,
    MAX_BODIES,
    MAX_RATES,
    MAX_ROWS,
    MAX_SHAPES,
    Body,
    Drive,
)
from mechlab.mechanism.relation_locks import refuse_locks
from mechlab.mechanism.tilt import refuse_tilts
from mechlab.mechanism.tree import too_many_bodies, too_many_rates, too_many_rows, too_many_shapes

CLOSURE_TOLERANCE = 1e-12
"""Largest residual of an assembled reference pose: of offsets in units of `length_scale`, of angles as sines."""
SMALLEST, LARGEST = 1e-9, 1e12
"""Sizes [m] within which mechlab works: rounding and the squares and cubes of lengths stay far from the ends of doubles."""


def validate(m: Mechanism, closed: bool = True) -> None:
    """Raise MechlabError for the first fault of a Mechanism; `closed`: its reference pose must be assembled, too."""
    if not m.bodies:
        raise MechlabError(f"mechanism {m.name!r} has no bodies: add at least one moving body.")
    if len(m.bodies) > MAX_BODIES:
        raise too_many_bodies(m.name)
    rates = sum(j.nv for b in m.bodies for j in b.joints)
    if rates > MAX_RATES:
        raise too_many_rates(m.name, rates)
    rows = sum(LOOP_ROWS.get(x.kind, 0) for x in m.loops) + len(m.relations) + len(m.curves)
    if rows > MAX_ROWS:
        raise too_many_rows(m.name, rows)
    shapes = len(m.ground_shapes) + sum(len(b.shapes) for b in m.bodies)
    if shapes > MAX_SHAPES:
        raise too_many_shapes(m.name, shapes)
    _names(m)
    _tree(m)
    for body in m.bodies:
        _joints(m, body)
    _attachments(m)
    refuse_tilts(m.name, m.bodies, m.loops)
    _linear(m)
    _curves(m)
    _masses(m)
    refuse_locks(m.name, m.relations)
    _size(m)
    refuse_collisions(m)
    if closed:
        _closed(m)


class OpenMechanism(Mechanism):
    """A mechanism that is checked in everything but closure."""

    def __post_init__(self) -> None:
        validate(self, closed=False)


class RecordedTree(Mechanism):
    """Bodies and joints of a model that no Mechanism holds, unchecked: they name and draw what an engine moved; nothing is
    computed with their masses, and they have no loops, relations, shafts or drives."""

    def __post_init__(self) -> None:
        """Nothing is checked."""


def _names(m: Mechanism) -> None:
    _identifiers("mechanism", [m.name])
    groups = {
        "body": [GROUND] + [b.name for b in m.bodies],
        "joint, shaft": [j.name for j in m.joints] + [s.name for s in m.shafts],
        "loop, relation, curve, spring": [*(x.name for x in m.loops), *(x.name for x in m.couplings), *(x.name for x in m.springs)],
        "drive": [d.name for d in m.drives],
        "frame": [f.name for f in m.frames],
    }
    for what, names in groups.items():
        _identifiers(what, names)
        for name, count in Counter(names).items():
            if count > 1:
                raise MechlabError(f"{m.name}: the {what} name {name!r} is used {count} times; names must be unique.")


def _identifiers(what: str, names: Iterable[str]) -> None:
    for name in names:
        if not isinstance(name, str) or not name or not all(c.isalnum() or c in "_-." for c in name):
            raise MechlabError(f"{what} name {name!r}: use letters, digits, '_', '-' and '.', at least one.")


def _tree(m: Mechanism) -> None:
    names = {b.name for b in m.bodies}
    for body in m.bodies:
        if body.parent != GROUND and body.parent not in names:
            raise unknown(f"{m.name}: parent of body {body.name!r}:", body.parent, names | {GROUND})
    parent = {b.name: b.parent for b in m.bodies}
    for body in m.bodies:
        seen, at = [body.name], body.parent
        while at != GROUND:
            if at in seen:
                raise MechlabError(f"{m.name}: the parents form a cycle: {' -> '.join([*seen, at])}. A loop is closed by a Loop.")
            seen.append(at)
            at = parent[at]
    path: list[str] = []
    for body in m.bodies:
        while path and path[-1] != body.parent:
            path.pop()
        if body.parent != GROUND and not path:
            raise MechlabError(
                f"{m.name}: body {body.name!r} does not follow its parent {body.parent!r} depth-first. "
                "Sort the bodies with mechlab.mechanism.depth_first (the Builder does)."
            )
        path.append(body.name)


def _finite(value: float, what: str, low: float = -math.inf) -> float:
    if not isinstance(value, int | float | np.floating) or not math.isfinite(value) or value < low:
        bound = "" if low == -math.inf else f" >= {low:g}"
        raise MechlabError(f"{what}: expected a finite number{bound}, got {value!r}.")
    return float(value)


def _joints(m: Mechanism, body: Body) -> None:
    for joint in body.joints:
        what = f"{m.name}: joint {joint.name!r}"
        if joint.kind not in JOINT_KINDS:
            raise unknown(f"{what}: kind", joint.kind, JOINT_KINDS)
        _direction(joint.axis, f"{what}: axis")
        for key in ("damping", "armature", "friction", "stiffness"):
            _finite(getattr(joint, key), f"{what}: {key}", 0.0)
        for key in ("zero", "spring_rest"):
            _finite(getattr(joint, key), f"{what}: {key}")
        _range(joint.range, what)
        if joint.kind == "spherical" and joint.range is not None and joint.range[0] != 0.0:
            raise MechlabError(f"{what}: the range of a spherical joint is (0, largest angle), got {joint.range!r}.")


def _range(ends: tuple[float, float] | None, what: str) -> None:
    if ends is not None and not (math.isfinite(ends[0]) and math.isfinite(ends[1]) and ends[0] < ends[1]):
        raise MechlabError(f"{what}: range must be (low, high) with low < high, got {ends!r}.")


def _direction(axis: Vector, what: str) -> None:
    norm = math.sqrt(sum(x * x for x in vector(axis, what)))
    if abs(norm - 1.0) > 1e-12:
        raise MechlabError(f"{what}: expected a unit vector, got {axis!r} of length {norm:.6g} (use {unit(axis, what)}).")


def _attachments(m: Mechanism) -> None:
    bodies = {GROUND} | {b.name for b in m.bodies}
    for loop in m.loops:
        if loop.kind not in LOOP_ROWS:
            raise unknown(f"{m.name}: loop {loop.name!r}: kind", loop.kind, LOOP_ROWS)
        for body in (loop.body_a, loop.body_b):
            if body not in bodies:
                raise unknown(f"{m.name}: loop {loop.name!r}: body", body, bodies)
        if loop.body_a == loop.body_b:
            raise MechlabError(f"{m.name}: loop {loop.name!r} connects body {loop.body_a!r} to itself.")
        if loop.kind == "distance":
            _finite(loop.length, f"{m.name}: loop {loop.name!r}: length", 1e-9)
    for spring in m.springs:
        for body in (spring.body_a, spring.body_b):
            if body not in bodies:
                raise unknown(f"{m.name}: spring {spring.name!r}: body", body, bodies)
        for key in ("point_a", "point_b"):
            vector(getattr(spring, key), f"{m.name}: spring {spring.name!r}: {key}")
        for key in ("stiffness", "damping", "rest_length"):
            _finite(getattr(spring, key), f"{m.name}: spring {spring.name!r}: {key}", 0.0)
        _range(spring.range, f"{m.name}: spring {spring.name!r}")
    for frame in m.frames:
        if frame.body not in bodies:
            raise unknown(f"{m.name}: frame {frame.name!r}: body", frame.body, bodies)
    targets = {j.name for j in m.joints if j.nv == 1} | {s.name for s in m.shafts}
    for drive in m.drives:
        if drive.on not in targets:
            raise unknown(f"{m.name}: drive {drive.name!r}: joint or shaft", drive.on, targets)
        for key in ("stiffness", "damping"):
            _finite(getattr(drive, key), f"{m.name}: drive {drive.name!r}: {key}", 0.0)
        if drive.limit is not None:
            _finite(drive.limit, f"{m.name}: drive {drive.name!r}: limit", 0.0)
        if drive.target is not None:
            _finite(drive.target, f"{m.name}: drive {drive.name!r}: target")
            if not drive.stiffness or drive.winding is not None:
                raise MechlabError(f"{m.name}: drive {drive.name!r}: only a servo, with a stiffness, has a target.")
        _winding(m, drive)
        _control(m, drive)


def _control(m: Mechanism, drive: Drive) -> None:
    if drive.control is None:
        return
    what = f"{m.name}: drive {drive.name!r}: control"
    if drive.winding is not None:
        raise MechlabError(f"{what}: the control of a DC motor (winding) is its voltage; it has no other units.")
    for key in ("gain", "gear", "push"):
        _finite(getattr(drive.control, key), f"{what}: {key}")
    if drive.control.gear == 0.0:
        raise MechlabError(f"{what}: a gear of 0 moves nothing.")
    for key in ("range", "force_range"):
        ends = getattr(drive.control, key)
        if ends is not None and not -math.inf < ends[0] <= ends[1] < math.inf:
            raise MechlabError(f"{what}: {key} must be (low, high) with low <= high, got {ends!r}.")


def _winding(m: Mechanism, drive: Drive) -> None:
    if drive.winding is None:
        return
    what = f"{m.name}: drive {drive.name!r}: winding"
    _finite(drive.winding.constant, f"{what}: constant")
    _finite(drive.winding.inductance, f"{what}: inductance", 0.0)
    if not _finite(drive.winding.resistance, f"{what}: resistance", 0.0) > 0.0:
        raise MechlabError(f"{what}: the resistance must be > 0 ohm.")
    if drive.stiffness or drive.damping:
        raise MechlabError(f"{what}: a drive is a servo (stiffness, damping) or a DC motor (winding), not both.")


def _linear(m: Mechanism) -> None:
    kinds = {j.name: j.kind for j in m.joints}
    sums = [(f"shaft {s.name!r}", s.coefficients) for s in m.shafts]
    sums += [(f"relation {r.name!r}", r.coefficients) for r in m.relations]
    for title, coefficients in sums:
        what = f"{m.name}: {title}"
        if not coefficients:
            raise MechlabError(f"{what} has no coefficients.")
        for name, count in Counter(n for n, _ in coefficients).items():
            if count > 1:
                raise MechlabError(f"{what} names joint {name!r} {count} times.")
        for name, c in coefficients:
            if name not in kinds:
                raise unknown(f"{what}: joint", name, kinds)
            if kinds[name] == "spherical":
                raise MechlabError(f"{what}: joint {name!r} is spherical and has no single angle.")
            if not isinstance(c, Fraction) or c == 0:
                raise MechlabError(f"{what}: coefficient of {name!r} must be a Fraction other than 0, got {c!r}.")
    bodies = {GROUND} | {b.name for b in m.bodies}
    for shaft in m.shafts:
        for key in ("inertia", "damping", "friction", "stiffness"):
            _finite(getattr(shaft, key), f"{m.name}: shaft {shaft.name!r}: {key}", 0.0)
        _range(shaft.range, f"{m.name}: shaft {shaft.name!r}")
        if shaft.body not in bodies:
            raise unknown(f"{m.name}: shaft {shaft.name!r}: body", shaft.body, bodies)
        if shaft.inertia > 0 or shaft.damping > 0:
            _one_path(m, shaft.name, [n for n, _ in shaft.coefficients])


def _curves(m: Mechanism) -> None:
    kinds = {j.name: j.kind for j in m.joints}
    for relation in m.curves:
        what = f"{m.name}: curve {relation.name!r}"
        for name in (relation.output, relation.input):
            if name not in kinds:
                raise unknown(f"{what}: joint", name, kinds)
            if kinds[name] == "spherical":
                raise MechlabError(f"{what}: joint {name!r} is spherical and has no single angle.")
        if relation.output == relation.input:
            raise MechlabError(f"{what} couples joint {relation.input!r} to itself; give two joints.")


def _one_path(m: Mechanism, shaft: str, names: list[str]) -> None:
    """Joints of a shaft with inertia or damping must lie on one root-to-leaf path: MuJoCo drops other off-diagonals."""
    home = {j.name: b.name for b in m.bodies for j in b.joints}
    parent = {b.name: b.parent for b in m.bodies}

    def ancestors(body: str) -> set[str]:
        out = {body}
        while parent.get(body, GROUND) != GROUND:
            body = parent[body]
            out.add(body)
        return out

    for i, a in enumerate(names):
        for b in names[i + 1 :]:
            if home[a] not in ancestors(home[b]) and home[b] not in ancestors(home[a]):
                raise MechlabError(
                    f"{m.name}: shaft {shaft!r} has inertia or damping, but its joints {a!r} and {b!r} do not lie on one path "
                    "from the root to a leaf; MuJoCo would drop their coupling silently. Give the part a body of its own."
                )


def _masses(m: Mechanism) -> None:
    """Raise MechlabError unless each moving body has the inertia that its joints need, its own or carried."""
    carried: dict[str, tuple[float, bool]] = {}
    for body in reversed(m.bodies):
        mass, turns = carried.get(body.name, (0.0, False))
        mass += body.inertia.mass
        turns = turns or any(x > 0 for x in body.inertia.tensor[:3])
        if body.joints and mass == 0.0:
            raise MechlabError(
                f"{m.name}: body {body.name!r} moves but has no mass, nor does anything it carries; give it an inertia."
            )
        if body.joints and not turns and any(j.kind == "spherical" for j in body.joints):
            raise MechlabError(f"{m.name}: body {body.name!r} turns freely but has no moment of inertia; give it one.")
        up = carried.get(body.parent, (0.0, False))
        carried[body.parent] = (up[0] + mass, up[1] or turns)


def _size(m: Mechanism) -> None:
    if m.size and not SMALLEST <= m.size <= LARGEST:
        raise MechlabError(
            f"{m.name}: its size is {m.size:.3g} m; mechlab computes with mechanisms from {SMALLEST:g} m to {LARGEST:g} m. "
            "Are the lengths in metres?"
        )


def _closed(m: Mechanism) -> None:
    constraints = ConstraintSet(m)
    if not len(constraints):
        return
    residual = constraints.residual(TreeKinematics(m))
    units = row_units(m, constraints)
    worst = int(np.argmax(np.abs(residual) / units))
    limit = CLOSURE_TOLERANCE * units[worst]
    if abs(residual[worst]) > limit:
        raise MechlabError(
            f"{m.name}: the reference pose is not assembled: {constraints.rows[worst]} is open by {abs(residual[worst]):.3g} "
            f"(limit {limit:.3g}). Correct the lengths, or close it with Builder.assemble(guess)."
        )


CHECKS.append(validate)
