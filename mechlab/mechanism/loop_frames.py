"""The frames of a loop's two ends from the axes of its joint.

The axis of a joint is local z of both frames. A universal joint has two pins instead, x of the first frame and y of the second one, which
its row x_a . y_b = 0 keeps perpendicular.
"""

from __future__ import annotations

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import Array, frame_along
from mechlab.mechanism.parts import AxisLike, axis_vector


def loop_frames(kind: str, what: str, axis_a: AxisLike | None, axis_b: AxisLike | None) -> tuple[Array, Array]:
    """(3, 3), (3, 3) rotations of the ends of a loop in their bodies. axis_a, axis_b: axes in each body's frame, z where none is given, the
    second like the first; of a universal loop its pins. Raises MechlabError for one pin alone, or for what is no axis."""
    if kind in ("spherical", "distance"):
        return np.eye(3), np.eye(3)
    if kind == "universal":
        if axis_a is None and axis_b is None:
            return np.eye(3), np.eye(3)
        if axis_a is None or axis_b is None:
            given, other = ("axis_b", "axis_a") if axis_a is None else ("axis_a", "axis_b")
            raise MechlabError(
                f"{what}: a universal loop has two pins, axis_a in body a and axis_b in body b, perpendicular to each other; "
                f"{given} alone is given. Give {other} too, or neither: then the pins are x of body a and y of body b."
            )
        (u, v, n), (a, b, m) = frame_along(axis_vector(axis_a, what)).T, frame_along(axis_vector(axis_b, what)).T
        return np.column_stack([n, u, v]), np.column_stack([b, m, a])
    frame = _along("z" if axis_a is None else axis_a, what)
    return frame, frame if axis_b is None else _along(axis_b, what)


def _along(axis: AxisLike, what: str) -> Array:
    return np.eye(3) if isinstance(axis, str) and axis == "z" else frame_along(axis_vector(axis, what))
