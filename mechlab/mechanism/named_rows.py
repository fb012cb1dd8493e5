"""Values, rows and biases of named quantities at a state, with numpy alone: joints, shafts, and coordinates of frames."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array, rotation_log
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism

LETTERS = ("x", "y", "z", "wx", "wy", "wz")
"""Coordinates of a frame: its position [m], its angular velocity [rad/s], world axes."""


class NamedRows:
    """Values, rows over the rates and biases dJ/dt v of joints, shafts and frame coordinates at a state."""

    def __init__(self, m: Mechanism) -> None:
        self.m, self.tree, self.constraints = m, TreeKinematics(m), ConstraintSet(m)
        self._parts = {f"{f.name}_{p}": (f, p) for f in m.frames for p in (*LETTERS, "rotation")}

    def set(self, q: Array, v: Array | None = None) -> NamedRows:
        """Sets the state that the other methods speak of: q (nq,), v (nv,); returns itself."""
        self.tree.set(q, v)
        return self

    def closure(self) -> Array:
        """(rows, nv) Jacobian of the constraints."""
        return self.constraints.jacobian(self.tree)

    def _point(self, name: str) -> tuple[str, Array, Array, str]:
        frame, part = self._parts[name]
        rotation, origin = self.tree.pose(frame.body)
        at = origin + rotation @ frame.placement.translation
        return frame.body, at, rotation @ frame.placement.rotation, part

    def _pick(self, six: Array, part: str) -> Array:
        return six[3:] if part == "rotation" else six[[LETTERS.index(part)]]

    def missing(self, name: str, target: Any) -> Array:
        """(rows,) value minus target; the rotation vector of a rotation."""
        if name in self.m.scalar_names:
            return np.array([float(self.m.value(name, self.tree.q)) - float(target)])
        _, at, rotation, part = self._point(name)
        if part == "rotation":
            return np.asarray(rotation_log(rotation @ np.asarray(target, dtype=float).T))
        return np.array([at[LETTERS.index(part)] - float(target)])

    def rows(self, name: str) -> Array:
        """(rows, nv) Jacobian of the quantity."""
        if name in self.m.scalar_names:
            return self.m.row(name)[None]
        body, at, _, part = self._point(name)
        return self._pick(self.tree.jacobian(body, at), part)

    def bias(self, name: str) -> Array:
        """(rows,) dJ/dt v."""
        if name in self.m.scalar_names:
            return np.zeros(1)
        body, at, _, part = self._point(name)
        return self._pick(self.tree.bias(body, at), part)

    def stack(self, names: Iterable[str]) -> Array:
        """The constraint rows, then the rows of the names."""
        return np.vstack([self.closure(), *(self.rows(n) for n in names)])
