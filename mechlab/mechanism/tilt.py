"""Planar loops whose axes are not quite parallel: both engines let them lock or shake without a warning.

A tilt of 3.7e-6 rad (an angle written as 1.5708) puts 2 kN on a loop that carries 1.7 N; 1e-3 rad locks it. Such a
loop is refused; or, if asked for, one of its binary links gets a ball joint, which absorbs the tilt.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import GROUND, Body, Joint, Loop
from mechlab.mechanism.tree import reference_poses

ROUNDING = 1e-9
"""Axes nearer than this [rad] are the same to within rounding of their placements."""
INTENDED = 0.05
"""Axes farther apart than this [rad] are meant to be apart: the loop is spatial."""
BALL_ARMATURE = 1e-5


@dataclass(frozen=True)
class Tilt:
    """A joint of a planar loop whose axis stands at `angle` [rad] to the common axis."""

    loop: str
    joint: str
    body: str
    angle: float


def tilts(bodies: Sequence[Body], loops: Sequence[Loop]) -> tuple[Tilt, ...]:
    """Tilted joints of all loops that are planar but for a tilt between 1e-9 and 0.05 rad: revolute axes parallel, slides
    perpendicular to them, closed by a pin ("spherical" or "revolute")."""
    by_name = {b.name: b for b in bodies}
    rotation = {name: r for name, (r, _) in reference_poses(bodies).items()}
    out: dict[tuple[str, str], Tilt] = {}
    for loop in loops:
        if loop.kind not in ("spherical", "revolute"):
            continue
        joints = _path(loop, by_name)
        if len(joints) < 3 or any(j.kind == "spherical" for _, j in joints):
            continue
        turning = [(b, j.name, rotation[b] @ np.array(j.axis)) for b, j in joints if j.kind == "revolute"]
        if loop.kind == "revolute":
            for body, place in ((loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b)):
                turning.append((body, f"{loop.name} (its axis in {body})", rotation[body] @ place.rotation[:, 2]))
        if len(turning) < 2:
            continue
        common = _common([axis for _, _, axis in turning])
        sines = _sines(common, np.array([axis for _, _, axis in turning]))
        found = [(b, n, sine) for (b, n, _), sine in zip(turning, sines.tolist(), strict=True)]
        found += [
            (b, j.name, abs(float(common @ rotation[b] @ np.array(j.axis)))) for b, j in joints if j.kind == "prismatic"
        ]
        if max(size for _, _, size in found) > INTENDED:
            continue
        for body, name, size in found:
            if size > ROUNDING:
                out[loop.name, name] = Tilt(loop.name, name, body, size)
    return tuple(out.values())


def refuse_tilts(what: str, bodies: Sequence[Body], loops: Sequence[Loop]) -> None:
    """Raise MechlabError that names the first tilted joint, its loop and the angle."""
    for tilt in tilts(bodies, loops):
        raise MechlabError(
            f"{what}: joint {tilt.joint!r} is tilted by {tilt.angle:.3g} rad against the other axes of the planar loop "
            f"{tilt.loop!r}; the loop would lock or shake. Write all its axes from one vector (no rounded angles such as "
            "1.5708), or ask for a ball joint in it: Builder.balls_for_tilt()."
        )


def with_balls(
    bodies: Sequence[Body], loops: Sequence[Loop], keep: frozenset[str]
) -> tuple[tuple[Body, ...], tuple[str, ...]]:
    """The bodies with a ball joint in each tilted loop, and the names of the joints that became one.

    The joint is that of a binary link at an end of the loop and not in `keep` (names that drives, shafts or relations
    use). Raises MechlabError when a loop has none.
    """
    out = {b.name: b for b in bodies}
    parents = {b.parent for b in bodies if b.joints}
    changed: list[str] = []
    for loop in loops:
        found = tilts(tuple(out.values()), [loop])
        if not found:
            continue
        ends = (loop.body_b, loop.body_a)
        culprits = [t.body for t in found if t.body in ends]
        for name in (*culprits, *ends):
            body = out.get(name)
            if body is None or len(body.joints) != 1 or name in parents or body.joints[0].name in keep:
                continue
            joint = body.joints[0]
            ball = Joint(joint.name, "spherical", joint.axis, armature=max(joint.armature, BALL_ARMATURE))
            out[name] = replace(body, joints=(ball,))
            changed.append(joint.name)
            break
        else:
            raise MechlabError(
                f"loop {loop.name!r} is tilted and no binary link at its ends ({loop.body_a}, {loop.body_b}) is free to get a "
                "ball joint (drives, shafts and relations need their joint as it is); write the axes from one vector."
            )
    return tuple(out.values()), tuple(changed)


def _path(loop: Loop, by_name: dict[str, Body]) -> list[tuple[str, Joint]]:
    """Joints on the path from one side of a loop to the other, with the names of their bodies."""

    def up(name: str) -> list[str]:
        out = []
        while name != GROUND:
            out.append(name)
            name = by_name[name].parent
        return out

    a, b = up(loop.body_a), up(loop.body_b)
    return [(n, j) for n in [*a, *b] if (n in a) != (n in b) for j in by_name[n].joints]


def _common(axes: Sequence[Array]) -> Array:
    """The axis that most of the given ones are parallel to; the first one of several."""
    stack = np.array(axes)
    return axes[int(np.argmax(np.sum(_sines(stack[:, None], stack) <= ROUNDING, axis=1)))]


def _sines(a: Array, b: Array) -> Array:
    """(...) sines of the angles between unit vectors (..., 3)."""
    (ax, ay, az), (bx, by, bz) = ([v[..., k] for k in range(3)] for v in (a, b))
    return np.sqrt((ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2 + (ax * by - ay * bx) ** 2)
