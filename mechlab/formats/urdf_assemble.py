"""Closing a mechanism whose file leaves its loops open in the zero pose, and saying which branch was taken.

Of the closed poses found, the one inside all joint ranges with the least motion from the zero pose is taken; a singular one
only where there is no other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.formats.urdf_closed_poses import NEAR, Closing, Group, largest
from mechlab.mechanism.assembly import rebased
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array, Placement
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.length_unit import coordinate_units
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Loop
from mechlab.mechanism.validate import CLOSURE_TOLERANCE, OpenMechanism
from mechlab.tables import counted, listed

NAMED = 4
"""Most names that a sentence lists."""


class StaysOpen(MechlabError):
    """No closed pose of the loops was found."""


def assemble(parts: Mapping[str, object]) -> tuple[Mechanism, tuple[str, ...]]:
    """The Mechanism of these parts (arguments of Mechanism), closed, and sentences on how; raises MechlabError that names
    the loop that stays open."""
    bare = OpenMechanism(**parts)  # type: ignore[arg-type]
    if not bare.loops:
        return Mechanism(**parts), ()  # type: ignore[arg-type]
    solver = Closing(bare)
    start = solver.m.reference()
    before = solver.residual(start)
    if largest(before) <= 0.1 * CLOSURE_TOLERANCE:
        return Mechanism(**parts), ("its loops are closed in the zero pose",)  # type: ignore[arg-type]
    q, groups = start, []
    for group in solver.groups:
        searched = solver.search(group, start)
        if not searched.found:
            raise StaysOpen(_stays_open(bare, solver, searched, before))
        groups.append(searched)
        q = solver.merged(q, searched.best.q, searched)
    pose = q * coordinate_units(bare, solver.unit)
    notes = _report(bare, solver, pose, groups, before)
    moved = dict(parts) | {"bodies": tuple(rebased(b, bare, pose) for b in bare.bodies)}
    mechanism, mended = _settled(moved, solver.unit)
    return mechanism, (*notes, *mended)


def _settled(parts: dict[str, object], unit: float) -> tuple[Mechanism, tuple[str, ...]]:
    """The Mechanism in its closed pose. Where rows that repeat others keep a gap of rounding size, the ends of these loops
    are moved onto each other."""
    bare = OpenMechanism(**parts)  # type: ignore[arg-type]
    rows, tree = ConstraintSet(bare), TreeKinematics(bare)
    residual = rows.residual(tree)
    if largest(residual) <= 0.5 * CLOSURE_TOLERANCE * min(unit, 1.0):
        return Mechanism(**parts), ()  # type: ignore[arg-type]
    loops, moved = [], []
    for loop in bare.loops:
        gap = largest(residual[rows.slices[loop.name]])
        if gap > 0.0 and loop.kind != "distance":
            loops.append(replace(loop, placement_b=_met(loop, tree)))
            moved.append((gap, loop.name))
        else:
            loops.append(loop)
    worst, name = max(moved, default=(0.0, ""))
    parts = parts | {"loops": tuple(loops)}
    ends = f"the ends of {counted(len(moved), 'loop')} were moved onto each other"
    note = f"{ends} by at most {worst:.2g} ({name}): the file's numbers are rounded"
    return Mechanism(**parts), (note,) if worst > 1e-11 else ()  # type: ignore[arg-type]


def _met(loop: Loop, tree: TreeKinematics) -> Placement:
    """The end b of a loop with the residual taken out: a ball end keeps its turn, a fixed one takes that of end a."""
    ra, pa = tree.pose(loop.body_a)
    rb, pb = tree.pose(loop.body_b)
    a, b, kind = loop.placement_a, loop.placement_b, loop.kind
    point, turned = pa + ra @ a.translation, ra @ a.rotation
    rotation, position = b.rotation, b.translation
    if kind in ("spherical", "universal", "revolute", "fixed"):
        position = rb.T @ (point - pb)
    if kind in ("fixed", "prismatic"):
        rotation = rb.T @ turned
    elif kind in ("revolute", "cylindrical"):
        rotation = rb.T @ _onto(rb @ rotation, turned[:, 2])
    if kind in ("prismatic", "cylindrical"):
        slide = turned[:, 2] @ (pb + rb @ b.translation - point)
        position = rb.T @ (point + slide * turned[:, 2] - pb)
    return Placement.of(rotation, position)


def _onto(rotation: Array, axis: Array) -> Array:
    """The rotation turned by the smallest angle so that its z is the axis."""
    x = rotation[:, 0] - (axis @ rotation[:, 0]) * axis
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


# -- what is said ----------------------------------------------------------------------------------------------------


def _report(m: Mechanism, solver: Closing, q: Array, groups: Sequence[Group], before: Array) -> tuple[str, ...]:
    """How far the zero pose was open, what moved; and for each group of loops how its branch was chosen."""
    steps = []
    for joint in m.joints:
        x = q[m.q_slice[joint.name]]
        if joint.kind == "spherical":
            steps.append((2.0 * float(np.arctan2(np.linalg.norm(x[1:]), abs(x[0]))), joint.name, "rad"))
        else:
            steps.append((float(x[0]), joint.name, "m" if joint.kind == "prismatic" else "rad"))
    large = sorted((s for s in steps if abs(s[0]) > 1e-9), key=lambda s: -abs(s[0]))
    named = ", ".join(f"{name} {value:+.4g} {unit}" for value, name, unit in large[:NAMED])
    more = f" and {len(large) - NAMED} more by at most {abs(large[NAMED][0]):.3g}" if len(large) > NAMED else ""
    gap, row = _worst(m, solver, before)
    after = max(g.best.residual for g in groups)
    first = f"the loops were open in the zero pose by {gap:.3g} ({row}) and are closed to {after:.1e} by moving {named}{more}"
    if max(g.best.motion for g in groups) < NEAR:
        return (f"{first}; no other branch was looked for",)
    ways: dict[str, list[str]] = {}
    for group in groups:
        ways.setdefault(_way(group), []).extend(group.names)
    return (first, *(f"branch of {listed(names)}: {way}" for way, names in ways.items()))


def _way(group: Group) -> str:
    best, count = group.best, len(group.found)
    starts = f"{counted(group.starts, 'start')} of Newton"
    chosen = "the only closed pose found"
    if count > 1:
        chosen = f"of {count} closed poses found, that with the least motion from the zero pose,"
    outside = f"; outside of their range in each: {listed(best.outside)}" if best.outside else ""
    return f"{chosen} from {starts}{outside}{'; it is singular, like all of them' if best.singular else ''}"


def _worst(m: Mechanism, solver: Closing, residual: Array) -> tuple[float, str]:
    k = int(np.argmax(np.abs(residual)))
    row = solver.rows.rows[k]
    loop = next((x for x in m.loops if row.startswith(f"{x.name}.")), None)
    offset = loop is not None and "_" not in row.removeprefix(loop.name)
    return abs(float(residual[k])) * (solver.unit if offset else 1.0), f"{row}{' [m]' if offset else ''}"


def _stays_open(m: Mechanism, solver: Closing, group: Group, before: Array) -> str:
    rows = np.zeros_like(before)
    rows[group.rows] = before[group.rows]
    gap, row = _worst(m, solver, rows)
    found = group.hopeless or f"no closed pose was found from {group.starts} starts of Newton"
    return (
        f"the loops do not close ({listed(group.names)}): {row} is open by {gap:.3g} in the zero pose, and {found}. Are the frames of its "
        "ends the right ones, is its type (3d, 6d) right, is a joint in it a ball or universal joint that the files call revolute?"
    )
