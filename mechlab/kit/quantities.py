"""Quantities of a mechanism by name: their keys, values, and rows over the rates.

Names: a joint or shaft X, X_rate, X_accel; a point FRAME_x of a frame, FRAME_x_rate, FRAME_x_accel; its angular velocity FRAME_wx
and angular acceleration FRAME_wx_rate, world axes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mechlab.errors import unknown
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array, rotation_log

LETTERS = ("x", "y", "z", "wx", "wy", "wz")
SUFFIXES = ("", "_rate", "_accel")


def quantities(m: Mechanism) -> tuple[str, ...]:
    """All quantities that can be given or asked for."""
    names = list(m.scalar_names) + [f"{f.name}_{a}" for f in m.frames for a in LETTERS[:3]]
    spins = [f"{f.name}_{a}" for f in m.frames for a in LETTERS[3:]]
    return (
        *names,
        *(f"{n}_rate" for n in names),
        *(f"{n}_accel" for n in names),
        *spins,
        *(f"{n}_rate" for n in spins),
    )


def level(m: Mechanism, key: str) -> tuple[str, int]:
    """The joint, shaft or frame coordinate of a quantity, and its order: 0 value, 1 rate, 2 acceleration.

    Raises MechlabError for a name that is no quantity of the mechanism.
    """
    spins = {f"{f.name}_{a}" for f in m.frames for a in LETTERS[3:]} - set(m.scalar_names)
    if key in spins:
        return key, 1
    if key.removesuffix("_rate") in spins:
        return key.removesuffix("_rate"), 2
    plain = {*m.scalar_names, *(f"{f.name}_{a}" for f in m.frames for a in (*LETTERS[:3], "rotation"))}
    if key in plain:
        return key, 0
    for order, suffix in enumerate(SUFFIXES):
        if order and key.endswith(suffix) and key.removesuffix(suffix) in plain:
            return key.removesuffix(suffix), order
    raise unknown(f"{m.name}: quantity", key, quantities(m))


def key_of(m: Mechanism, name: str, order: int) -> str:
    """The key of a joint, shaft or frame coordinate at a level: the inverse of `level`."""
    frames = {f.name for f in m.frames}
    frame, _, letter = name.rpartition("_")
    spin = letter in LETTERS[3:] and frame in frames and name not in m.scalar_names
    return name + SUFFIXES[order - 1 if spin else order]


def split(m: Mechanism, values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, float], dict[str, float]]:
    """Given quantities as values, rates and accelerations, keyed by joint, shaft or frame coordinate."""
    out: tuple[dict[str, Any], dict[str, float], dict[str, float]] = ({}, {}, {})
    for key, value in values.items():
        name, order = level(m, key)
        out[order][name] = value
    return out


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
