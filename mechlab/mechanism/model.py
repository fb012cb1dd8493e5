"""The mechanism: a tree of bodies, what closes it, what couples it, what drives it (`mechlab.mechanism.parts`).

Two mechanisms are equal when their data are. A Mechanism is checked when it is made: an object that exists is valid.
The check (`mechlab.mechanism.validate`) needs kinematics, which need this module; so it registers itself here instead
of being imported. The package `mechlab.mechanism` imports it with Builder, hence no Mechanism is made without it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.errors import explained, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.curve import CurveRelation
from mechlab.mechanism.geometry import Array, Vector
from mechlab.mechanism.parts import Body, Coefficients, Drive, Frame, Joint, LinearRelation, Loop, Shaft, Shape, Spring
from mechlab.mechanism.tree import size, unit_of_length
from mechlab.results import Result

CHECKS: list[Callable[[Mechanism], None]] = []
"""Checks that every Mechanism passes when it is made; filled by `mechlab.mechanism.validate`."""


@explained
@dataclass(frozen=True, repr=False)
class Mechanism(Result[Path]):
    """A tree of bodies, depth-first, and what closes, couples and drives it. All coordinates are 0 in the reference
    pose (spherical joints: the identity), and the reference pose is assembled.

    Raises MechlabError at construction for data that are not valid; see `mechlab.mechanism.validate`.
    """

    name: str
    bodies: tuple[Body, ...]
    loops: tuple[Loop, ...] = ()
    relations: tuple[LinearRelation, ...] = ()
    shafts: tuple[Shaft, ...] = ()
    springs: tuple[Spring, ...] = ()
    drives: tuple[Drive, ...] = ()
    frames: tuple[Frame, ...] = ()
    gravity: Vector = (0.0, 0.0, -9.81)
    ground_shapes: tuple[Shape, ...] = ()
    summary: str = field(default="", compare=True)
    curves: tuple[CurveRelation, ...] = field(default=(), metadata={"brief": True})

    def __post_init__(self) -> None:
        for check in CHECKS:
            check(self)

    def __hash__(self) -> int:
        """Of the content, found once: tables of kept models ask for it at every call."""
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash(tuple(getattr(self, f.name) for f in fields(self)))

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled; hashes of texts are others in another process."""
        return {k: x for k, x in self.__dict__.items() if k != "_hash"}

    # -- names ---------------------------------------------------------------------------------------------------

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints, in the order of the coordinates."""
        return tuple(j for b in self.bodies for j in b.joints)

    @cached_property
    def nq(self) -> int:
        """Number of coordinates."""
        return sum(j.nq for j in self.joints)

    @cached_property
    def nv(self) -> int:
        """Number of rates."""
        return sum(j.nv for j in self.joints)

    @cached_property
    def q_slice(self) -> dict[str, slice]:
        """Joint name -> its coordinates in q."""
        return _slices([(j.name, j.nq) for j in self.joints])

    @cached_property
    def v_slice(self) -> dict[str, slice]:
        """Joint name -> its rates in v."""
        return _slices([(j.name, j.nv) for j in self.joints])

    @cached_property
    def joint_of_rate(self) -> tuple[Joint, ...]:
        """For each entry of v its joint."""
        return tuple(j for j in self.joints for _ in range(j.nv))

    @cached_property
    def slides(self) -> frozenset[str]:
        """Names of the prismatic joints, whose coordinates are lengths."""
        return frozenset(j.name for j in self.joints if j.kind == "prismatic")

    @cached_property
    def rate_names(self) -> tuple[str, ...]:
        """One name for each entry of v: the joint, or joint_x, joint_y, joint_z of a spherical one."""
        return tuple(n for j in self.joints for n in ([j.name] if j.nv == 1 else [f"{j.name}_{a}" for a in "xyz"]))

    @cached_property
    def _by_name(self) -> dict[str, dict[str, object]]:
        return {
            "body": {b.name: b for b in self.bodies},
            "joint": {j.name: j for j in self.joints},
            "shaft": {s.name: s for s in self.shafts},
            "frame": {f.name: f for f in self.frames},
            "loop": {x.name: x for x in self.loops},
            "relation": {x.name: x for x in self.relations},
            "curve": {x.name: x for x in self.curves},
            "drive": {d.name: d for d in self.drives},
        }

    def _find(self, what: str, name: str) -> object:
        try:
            return self._by_name[what][name]
        except KeyError:
            raise unknown(f"{self.name}: {what}", name, self._by_name[what]) from None

    def body(self, name: str) -> Body:
        """The body of that name; raises MechlabError that lists the bodies."""
        found = self._find("body", name)
        assert isinstance(found, Body)
        return found

    def joint(self, name: str) -> Joint:
        """The joint of that name; raises MechlabError that lists the joints."""
        found = self._find("joint", name)
        assert isinstance(found, Joint)
        return found

    def frame(self, name: str) -> Frame:
        """The frame of that name; raises MechlabError that lists the frames."""
        found = self._find("frame", name)
        assert isinstance(found, Frame)
        return found

    # -- coordinates ---------------------------------------------------------------------------------------------

    def reference(self) -> Array:
        """(nq,) coordinates of the reference pose: zeros, and identity quaternions."""
        q = np.zeros(self.nq)
        for joint in self.joints:
            if joint.kind == "spherical":
                q[self.q_slice[joint.name].start] = 1.0
        return q

    @cached_property
    def scalar_names(self) -> tuple[str, ...]:
        """Names of everything that has one value: revolute and prismatic joints, then shafts."""
        return tuple(j.name for j in self.joints if j.nv == 1) + tuple(s.name for s in self.shafts)

    @cached_property
    def _rows(self) -> dict[str, Array]:
        rows: dict[str, Array] = {}
        unit = np.eye(self.nv)
        for joint in self.joints:
            if joint.nv == 1:
                rows[joint.name] = unit[self.v_slice[joint.name].start]
        for shaft in self.shafts:
            rows[shaft.name] = self.coefficient_row(shaft.coefficients)
        for row in rows.values():
            row.flags.writeable = False
        return rows

    def row(self, name: str) -> Array:
        """(nv,) coefficients c of a joint or shaft: its rate is c @ v. Raises MechlabError that lists the names."""
        try:
            return self._rows[name]
        except KeyError:
            raise unknown(f"{self.name}: joint or shaft", name, self._rows) from None

    def coefficient_row(self, coefficients: Coefficients) -> Array:
        """(nv,) row of floats of exact coefficients."""
        row = np.zeros(self.nv)
        for name, c in coefficients:
            if name not in self.v_slice:
                raise unknown(f"{self.name}: joint", name, self.v_slice)
            row[self.v_slice[name].start] += float(c)
        return row

    @cached_property
    def _zeros(self) -> dict[str, float]:
        return {j.name: j.zero for j in self.joints} | {s.name: s.zero for s in self.shafts}

    def zero(self, name: str) -> float:
        """Physical value of a joint or shaft at the reference pose."""
        if name not in self._zeros:
            raise unknown(f"{self.name}: joint or shaft", name, self._rows)
        return self._zeros[name]

    def value(self, name: str, q: Array) -> Array:
        """Physical value of a joint or shaft at coordinates q (..., nq): zero + coordinate."""
        return self.zero(name) + np.asarray(q)[..., self.q_columns] @ self.row(name)

    @cached_property
    def q_columns(self) -> Array:
        """(nv,) the coordinate that each rate changes; for spherical joints the vector part, with zero coefficients."""
        columns: list[int] = []
        for joint in self.joints:
            start = self.q_slice[joint.name].start
            columns += [start] if joint.nv == 1 else [start + 1, start + 2, start + 3]
        return np.array(columns, dtype=int)

    @cached_property
    def size(self) -> float:
        """Largest distance [m] of any point of the mechanism from the origin in the reference pose; see
        `mechlab.mechanism.tree`."""
        return size(self.bodies, self.loops, self.springs, self.frames)

    @cached_property
    def length_scale(self) -> float:
        """Unit of length [m] in which the mechanism has a size of order 1: a power of two, 1 from 1 cm to 100 m."""
        return unit_of_length(self.size)

    @property
    def couplings(self) -> tuple[LinearRelation | CurveRelation, ...]:
        """What couples joints by a row of its own: the linear relations, then the curves."""
        out: tuple[LinearRelation | CurveRelation, ...] = self.relations
        return out + self.curves

    @property
    def is_closed(self) -> bool:
        """Whether anything closes or couples it: loops, linear relations, curves."""
        return bool(self.loops or self.relations or self.curves)

    @property
    def total_mass(self) -> float:
        """Mass of all bodies [kg], fixed ones included."""
        return sum(b.inertia.mass for b in self.bodies)


def _slices(sizes: list[tuple[str, int]]) -> dict[str, slice]:
    out: dict[str, slice] = {}
    start = 0
    for name, n in sizes:
        out[name] = slice(start, start + n)
        start += n
    return out
