"""What a controller observes of a mechanism: a row of named numbers that is affine in the state, and points of frames.

    observation = selection @ (q, v) + offset,   then x, y, z of each frame that is asked for

By default all joints, then all their rates. Values of joints and shafts are physical: zero + coordinate.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import is_length
from mechlab.mechanism.model import Mechanism


@dataclass(frozen=True)
class Observed:
    """The numbers that are observed, by name, with units.

    selection (k, nq + nv), offset (k,): of the state (q, v) of the Mechanism; frames: names, three numbers each after those
    k. low, high (k + 3 frames,): ranges of joints; infinite where a number has none.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    selection: Array
    offset: Array
    frames: tuple[str, ...]
    low: Array
    high: Array


def observed(mechanism: Mechanism, names: Sequence[str] = ()) -> Observed:
    """What stands behind these names: joints and shafts, X_rate, and frames, whose names give X_x, X_y, X_z [m].

    A spherical joint X gives X_w, X_x, X_y, X_z (quaternion), its rate X_rate_x, X_rate_y, X_rate_z [rad/s]. No names: all
    joints, then all their rates. Raises MechlabError for an unknown name or one given twice, listing what exists.
    """
    m = mechanism
    joints = [j.name for j in m.joints]
    asked = list(names) or [*joints, *(f"{j}_rate" for j in joints)]
    frames = [n for n in asked if n in {f.name for f in m.frames}]
    scalars = [n for n in asked if n not in frames]
    for name in asked:
        if asked.count(name) > 1:
            raise MechlabError(f"{m.name}: observe: {name!r} is given twice.")
    parts = [_of(m, name) for name in scalars]
    labels = [x for part in parts for x in part.names] + [f"{n}_{axis}" for n in frames for axis in "xyz"]
    units = [x for part in parts for x in part.units] + ["m"] * (3 * len(frames))
    ends = [_range(m, name) for name in scalars]
    wide = np.concatenate(
        [np.tile(e, (len(p.names), 1)) for p, e in zip(parts, ends, strict=True)] or [np.zeros((0, 2))]
    )
    wide = np.vstack([wide, np.tile((-np.inf, np.inf), (3 * len(frames), 1))])
    return Observed(
        tuple(labels), tuple(units), np.vstack([p.rows for p in parts] or [np.zeros((0, m.nq + m.nv))]),
        np.concatenate([p.offset for p in parts] or [np.zeros(0)]), tuple(frames), wide[:, 0], wide[:, 1],
    )  # fmt: skip


@dataclass(frozen=True)
class _Part:
    """The numbers of one name: rows (k, nq + nv) and offset (k,)."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: Array
    offset: Array


def _of(m: Mechanism, name: str) -> _Part:
    """The rows of a joint, a shaft, or a rate of one."""
    is_rate = name not in m.scalar_names and name not in m.q_slice
    base = name.removesuffix("_rate") if is_rate else name
    spherical = {j.name for j in m.joints if j.kind == "spherical"}
    if base in spherical:
        where = m.v_slice[base] if is_rate else m.q_slice[base]
        first = m.nq + where.start if is_rate else where.start
        letters = "xyz" if is_rate else "wxyz"
        labels = tuple(f"{name}_{letter}" for letter in letters)
        rows = np.eye(m.nq + m.nv)[first : first + len(letters)]
        return _Part(labels, ("rad/s" if is_rate else "",) * len(letters), rows, np.zeros(len(letters)))
    if base not in m.scalar_names:
        existing = [*m.scalar_names, *spherical, *(f"{n}_rate" for n in (*m.scalar_names, *spherical))]
        raise unknown(f"{m.name}: observe:", name, [*existing, *(f.name for f in m.frames)])
    unit = "m" if is_length(m, base) else "rad"
    row, out = m.row(base), np.zeros(m.nq + m.nv)
    if is_rate:
        out[m.nq :] = row
        return _Part((name,), (f"{unit}/s",), out[None], np.zeros(1))
    for column, c in zip(m.q_columns, row, strict=True):
        out[column] += c
    return _Part((name,), (unit,), out[None], np.array([m.zero(base)]))


def _range(m: Mechanism, name: str) -> tuple[float, float]:
    """The range of a joint; a quaternion is between -1 and 1; anything else is without bounds."""
    for joint in m.joints:
        if joint.name == name and joint.kind == "spherical":
            return -1.0, 1.0
        if joint.name == name and joint.range is not None:
            return float(joint.range[0]), float(joint.range[1])
    return -np.inf, np.inf
