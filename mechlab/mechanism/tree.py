"""The tree of bodies in the reference pose: order, poses, size. Needs no Mechanism, only its parts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import GROUND, MAX_BODIES, MAX_RATES, MAX_ROWS, MAX_SHAPES, Body, Frame, Loop, Spring

ORDINARY_SIZES = (1e-2, 1e2)
"""Sizes [m] at which the unit of length stays the metre."""


def too_many_bodies(name: str) -> MechlabError:
    """The error for a mechanism with more than MAX_BODIES bodies."""
    return MechlabError(
        f"mechanism {name!r} has more than {MAX_BODIES} bodies, for which mechlab is not made. "
        "Weld parts that do not move against each other into one body."
    )


def no_joints(name: str) -> MechlabError:
    """The error where an engine is asked for a mechanism without joints."""
    return MechlabError(f"{name}: it has no joints, so nothing in it moves. `mechlab show` and `mechlab view --png` take such a model.")


def too_many_rates(name: str, rates: int) -> MechlabError:
    """The error for a mechanism with more than MAX_RATES rates."""
    return MechlabError(
        f"mechanism {name!r} has {rates} rates (freedoms of its joints), the limit is {MAX_RATES}: ranks are taken of dense matrices. "
        "Weld parts that do not move against each other into one body, or give them joints of fewer freedoms."
    )


def too_many_rows(name: str, rows: int) -> MechlabError:
    """The error for a mechanism with more than MAX_ROWS constraint rows."""
    return MechlabError(
        f"mechanism {name!r} has {rows} constraint rows, the limit is {MAX_ROWS}, as for its rates. "
        "Leave out loops and relations that repeat others."
    )


def too_many_shapes(name: str, shapes: int) -> MechlabError:
    """The error for a mechanism with more than MAX_SHAPES shapes."""
    return MechlabError(
        f"mechanism {name!r} has {shapes} shapes (geoms, visuals), the limit is {MAX_SHAPES}. "
        "Draw a part of many pieces with one mesh."
    )


def depth_first(bodies: Sequence[Body]) -> tuple[Body, ...]:
    """The bodies sorted so that each follows its parent depth-first; siblings keep their order.

    Raises MechlabError for a name that is used twice or is the ground's, a parent that does not exist, or a cycle.
    """
    names: set[str] = set()
    for body in bodies:
        if body.name == GROUND:
            raise MechlabError(f"a body cannot be called {GROUND!r}: that is the fixed body. Give it another name.")
        if body.name in names:
            raise MechlabError(f"the body name {body.name!r} is used more than once; names must be unique.")
        names.add(body.name)
    children: dict[str, list[Body]] = {}
    for body in bodies:
        if body.parent != GROUND and body.parent not in names:
            raise unknown(f"parent of body {body.name!r}:", body.parent, names | {GROUND})
        children.setdefault(body.parent, []).append(body)
    out: list[Body] = []
    stack = list(reversed(children.get(GROUND, [])))
    while stack:
        body = stack.pop()
        out.append(body)
        stack += reversed(children.get(body.name, []))
    if len(out) != len(bodies):
        lost = sorted(names - {b.name for b in out})
        raise MechlabError(
            f"the parents of {', '.join(lost)} form a cycle: none of them hangs on {GROUND!r} in the end."
        )
    return tuple(out)


def reference_poses(bodies: Sequence[Body]) -> dict[str, tuple[Array, Array]]:
    """Body name -> rotation (3, 3) body to world and origin (3,) [m] in the reference pose, the ground included.

    The bodies may stand in any order; one whose parent does not exist is left out.
    """
    out: dict[str, tuple[Array, Array]] = {GROUND: (np.eye(3), np.zeros(3))}
    waiting = list(bodies)
    while ready := [b for b in waiting if b.parent in out]:
        for body in ready:
            rotation, origin = out[body.parent]
            out[body.name] = rotation @ body.placement.rotation, origin + rotation @ body.placement.translation
        waiting = [b for b in waiting if b.name not in out]
    return out


def size(bodies: Sequence[Body], loops: Sequence[Loop], springs: Sequence[Spring], frames: Sequence[Frame]) -> float:
    """Largest distance [m] along an axis of a joint, loop end, spring end, frame or centre of mass from the origin, in
    the reference pose. The rounding of positions scales with it. 0 where all of them lie in the origin."""
    points = [(b.name, (0.0, 0.0, 0.0)) for b in bodies]
    points += [(b.name, b.inertia.com) for b in bodies if b.inertia.mass > 0.0]
    points += [end for x in loops for end in ((x.body_a, x.placement_a.position), (x.body_b, x.placement_b.position))]
    points += [end for x in springs for end in ((x.body_a, x.point_a), (x.body_b, x.point_b))]
    points += [(f.body, f.placement.position) for f in frames]
    with np.errstate(over="ignore", invalid="ignore"):
        poses = reference_poses(bodies)
        places = np.abs([poses[body][1] + poses[body][0].dot(point) for body, point in points])
    return float(places.max(initial=0.0)) if np.isfinite(places).all() else math.inf


def unit_of_length(size: float) -> float:
    """The unit of length [m] that fits a mechanism of a size [m]: 1 from 1 cm to 100 m and without any length, else a
    power of two, so that the change of unit is exact."""
    if size == 0.0 or not math.isfinite(size) or ORDINARY_SIZES[0] <= size <= ORDINARY_SIZES[1]:
        return 1.0
    return 2.0 ** round(math.log2(size))
