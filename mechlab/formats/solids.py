"""Shapes that MJCF and URDF draw themselves, without a mesh."""

from __future__ import annotations

from mechlab.errors import MechlabError
from mechlab.mechanism.shape import Shape

SIZES = {"box": ("x", "y", "z"), "cylinder": ("radius", "length"), "sphere": ("radius",)}


def primitive(item: Shape) -> tuple[float, ...] | None:
    """The sizes of a box (edges), cylinder (radius, length) or sphere (radius); None for any other solid.

    A cylinder with a chamfer is none. Raises MechlabError when a size is missing.
    """
    if item.kind not in SIZES or item.parameters.get("chamfer"):
        return None
    given = item.parameters
    missing = [k for k in SIZES[item.kind] if k not in given]
    if missing:
        raise MechlabError(f"shape {item.name or item.kind!r}: missing {', '.join(missing)}.")
    return tuple(given[k] for k in SIZES[item.kind])
