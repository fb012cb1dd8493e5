"""Constraints over a Kinematics: residual, Jacobian, bias and row names of loops, linear relations and curves.

Every loop is built of two kinds of row between a frame a in body A and a frame b in body B:

    offset row   r = u_a . (p_b - p_a)     u_a fixed in A
    angle row    r = u_a . w_b             u_a fixed in A, w_b fixed in B

Rows are written in the axes of frame a, so that a redundant row of a planar loop is one row with a name.
Jacobians and biases are the exact first and second time derivatives of the residual, also off the constraint.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.curve import CurveRelation
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.kinematics import Kinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import LinearRelation, Loop

AXES = "xyz"
# kind -> axes of the offset rows, (axis of a, axis of b) of the angle rows
_LOOP_TABLE: dict[str, tuple[str, tuple[tuple[str, str], ...]]] = {
    "spherical": ("xyz", ()),
    "revolute": ("xyz", (("x", "z"), ("y", "z"))),
    "universal": ("xyz", (("x", "y"),)),
    "cylindrical": ("xy", (("x", "z"), ("y", "z"))),
    "prismatic": ("xy", (("x", "z"), ("y", "z"), ("x", "y"))),
    "fixed": ("xyz", (("x", "z"), ("y", "z"), ("x", "y"))),
}


class Constraint(Protocol):
    """Rows that must vanish: r(q) = 0, with J = dr/dq and b = dJ/dt v, so that d2r/dt2 = J a + b."""

    @property
    def name(self) -> str:
        """Name of the loop or relation."""
        ...

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the rows."""
        ...

    def residual(self, kin: Kinematics) -> Array:
        """(rows,) r(q) [m, or a dimensionless sine of an angle]."""
        ...

    def jacobian(self, kin: Kinematics) -> Array:
        """(rows, nv) J(q)."""
        ...

    def bias(self, kin: Kinematics) -> Array:
        """(rows,) dJ/dt v."""
        ...


@dataclass(frozen=True)
class LoopConstraint:
    """The rows of a Loop of any kind except distance."""

    loop: Loop

    @property
    def name(self) -> str:
        """Name of the loop."""
        return self.loop.name

    @cached_property
    def rows(self) -> tuple[str, ...]:
        """Row names: offset rows "name.x", angle rows "name.x_z" (x of a against z of b)."""
        offsets, angles = _LOOP_TABLE[self.loop.kind]
        return tuple(f"{self.name}.{a}" for a in offsets) + tuple(f"{self.name}.{a}_{b}" for a, b in angles)

    @cached_property
    def _placed(self) -> tuple[Array, Array, Array, Array]:
        a, b = self.loop.placement_a, self.loop.placement_b
        return a.rotation, a.translation, b.rotation, b.translation

    def ends(self, kin: Kinematics) -> tuple[Array, Array, Array, Array]:
        """Rotation to world and origin in the world of end a, and of end b."""
        (ra, pa), (rb, pb) = kin.pose(self.loop.body_a), kin.pose(self.loop.body_b)
        turn_a, point_a, turn_b, point_b = self._placed
        return ra.dot(turn_a), pa + ra.dot(point_a), rb.dot(turn_b), pb + rb.dot(point_b)

    def residual(self, kin: Kinematics) -> Array:
        """(rows,) offsets [m] and sines."""
        ra, pa, rb, pb = self.ends(kin)
        offsets, angles = _LOOP_TABLE[self.loop.kind]
        d = pb - pa
        out = [ra[:, AXES.index(u)].dot(d) for u in offsets]
        out += [ra[:, AXES.index(u)].dot(rb[:, AXES.index(w)]) for u, w in angles]
        return np.array(out)

    def jacobian(self, kin: Kinematics) -> Array:
        """(rows, nv)."""
        ra, pa, rb, pb = self.ends(kin)
        offsets, angles = _LOOP_TABLE[self.loop.kind]
        ja, jb = kin.jacobian(self.loop.body_a, pa), kin.jacobian(self.loop.body_b, pb)
        d = pb - pa
        relative, turning = jb[:3] - ja[:3], ja[3:] - jb[3:]
        out = [ra[:, k].dot(relative) + cross(ra[:, k], d).dot(ja[3:]) for k in map(AXES.index, offsets)]
        out += [cross(ra[:, AXES.index(u)], rb[:, AXES.index(w)]).dot(turning) for u, w in angles]
        return np.array(out)

    def wrenches(self, kin: Kinematics) -> Array:
        """(rows, 6) force and moment on body b, about the origin of its end, of a unit reaction of each row where the loop is closed."""
        ra, _, rb, _ = self.ends(kin)
        offsets, angles = _LOOP_TABLE[self.loop.kind]
        out = np.zeros((len(self.rows), 6))
        out[: len(offsets), :3] = [ra[:, AXES.index(u)] for u in offsets]
        if angles:
            out[len(offsets) :, 3:] = [cross(rb[:, AXES.index(w)], ra[:, AXES.index(u)]) for u, w in angles]
        return out

    def bias(self, kin: Kinematics) -> Array:
        """(rows,) dJ/dt v."""
        ra, pa, rb, pb = self.ends(kin)
        offsets, angles = _LOOP_TABLE[self.loop.kind]
        va, vb = kin.velocity(self.loop.body_a, pa), kin.velocity(self.loop.body_b, pb)
        aa, ab = kin.bias(self.loop.body_a, pa), kin.bias(self.loop.body_b, pb)
        d, dd, wa, wb = pb - pa, vb[:3] - va[:3], va[3:], vb[3:]
        out = []
        for k in map(AXES.index, offsets):
            u = ra[:, k]
            du = cross(wa, u)
            ddu = cross(aa[3:], u) + cross(wa, du)
            out.append(ddu @ d + 2.0 * (du @ dd) + u @ (ab[:3] - aa[:3]))
        for i, j in angles:
            u, w = ra[:, AXES.index(i)], rb[:, AXES.index(j)]
            du, dw = cross(wa, u), cross(wb, w)
            ddu = cross(aa[3:], u) + cross(wa, du)
            ddw = cross(ab[3:], w) + cross(wb, dw)
            out.append(ddu @ w + 2.0 * (du @ dw) + u @ ddw)
        return np.array(out)


@dataclass(frozen=True)
class DistanceConstraint:
    """The one row of a distance loop: (|p_b - p_a|^2 - length^2) / (2 length) [m]."""

    loop: Loop

    @property
    def name(self) -> str:
        """Name of the loop."""
        return self.loop.name

    @property
    def rows(self) -> tuple[str, ...]:
        """The one row name."""
        return (f"{self.name}.length",)

    def _ends(self, kin: Kinematics) -> tuple[Array, Array]:
        ra, pa = kin.pose(self.loop.body_a)
        rb, pb = kin.pose(self.loop.body_b)
        return pa + ra @ self.loop.placement_a.translation, pb + rb @ self.loop.placement_b.translation

    def residual(self, kin: Kinematics) -> Array:
        """(1,) [m]."""
        pa, pb = self._ends(kin)
        d = pb - pa
        return np.array([(d @ d - self.loop.length**2) / (2.0 * self.loop.length)])

    def jacobian(self, kin: Kinematics) -> Array:
        """(1, nv)."""
        pa, pb = self._ends(kin)
        relative = kin.jacobian(self.loop.body_b, pb)[:3] - kin.jacobian(self.loop.body_a, pa)[:3]
        return ((pb - pa) @ relative / self.loop.length)[None, :]

    def bias(self, kin: Kinematics) -> Array:
        """(1,) dJ/dt v."""
        pa, pb = self._ends(kin)
        dd = (kin.velocity(self.loop.body_b, pb) - kin.velocity(self.loop.body_a, pa))[:3]
        acc = (kin.bias(self.loop.body_b, pb) - kin.bias(self.loop.body_a, pa))[:3]
        return np.array([(dd @ dd + (pb - pa) @ acc) / self.loop.length])


class _OneRow:
    """What couples joints by one row, which has its name."""

    relation: LinearRelation | CurveRelation

    @property
    def name(self) -> str:
        """Name of the relation."""
        return self.relation.name

    @property
    def rows(self) -> tuple[str, ...]:
        """The one row name: that of the relation."""
        return (self.name,)


@dataclass(frozen=True)
class RelationConstraint(_OneRow):
    """The one row of a LinearRelation: sum of coefficient x coordinate. Its Jacobian is constant, its bias zero."""

    relation: LinearRelation
    mechanism: Mechanism

    @cached_property
    def _terms(self) -> list[tuple[float, int]]:
        return [(float(c), self.mechanism.q_slice[n].start) for n, c in self.relation.coefficients]

    @cached_property
    def _row(self) -> Array:
        return self.mechanism.coefficient_row(self.relation.coefficients)[None, :]

    def residual(self, kin: Kinematics) -> Array:
        """(1,) [rad or m]."""
        q = np.asarray(kin.q)
        return np.array([sum(c * q[k] for c, k in self._terms)])

    def jacobian(self, kin: Kinematics) -> Array:
        """(1, nv)."""
        return self._row.copy()

    def bias(self, kin: Kinematics) -> Array:
        """(1,) zero."""
        return np.zeros(1)


@dataclass(frozen=True)
class CurveConstraint(_OneRow):
    """The one row of a CurveRelation: output - f(input), values of the two joints."""

    relation: CurveRelation
    mechanism: Mechanism

    @cached_property
    def _places(self) -> tuple[int, int, int, int, float, float]:
        """Where output and input stand in q and in v, and their zeros."""
        m, (b, a) = self.mechanism, (self.relation.output, self.relation.input)
        return m.q_slice[b].start, m.q_slice[a].start, m.v_slice[b].start, m.v_slice[a].start, m.zero(b), m.zero(a)

    def _law(self, kin: Kinematics) -> tuple[float, float, float]:
        _, a, _, _, _, zero = self._places
        return self.relation.curve.at(zero + float(kin.q[a]))

    def residual(self, kin: Kinematics) -> Array:
        """(1,) [rad or m]."""
        b, _, _, _, zero, _ = self._places
        return np.array([zero + float(kin.q[b]) - self._law(kin)[0]])

    def jacobian(self, kin: Kinematics) -> Array:
        """(1, nv): 1 at the output, -f' at the input."""
        _, _, b, a, _, _ = self._places
        row = np.zeros((1, self.mechanism.nv))
        row[0, b], row[0, a] = 1.0, -self._law(kin)[1]
        return row

    def bias(self, kin: Kinematics) -> Array:
        """(1,) -f'' (rate of the input)^2."""
        return np.array([-self._law(kin)[2] * float(kin.v[self._places[3]]) ** 2])


class ConstraintSet:
    """All constraints of a Mechanism, stacked: loops in order, then relations in order, then curves in order."""

    def __init__(self, mechanism: Mechanism) -> None:
        items: list[Constraint] = [
            DistanceConstraint(x) if x.kind == "distance" else LoopConstraint(x) for x in mechanism.loops
        ]
        items += [RelationConstraint(x, mechanism) for x in mechanism.relations]
        items += [CurveConstraint(x, mechanism) for x in mechanism.curves]
        self.mechanism = mechanism
        self.items: Sequence[Constraint] = tuple(items)
        self.rows = tuple(r for c in self.items for r in c.rows)
        self.slices: dict[str, slice] = {}
        start = 0
        for c in self.items:
            self.slices[c.name] = slice(start, start + len(c.rows))
            start += len(c.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def _stack(self, parts: list[Array], shape: tuple[int, ...]) -> Array:
        return np.concatenate(parts) if parts else np.zeros(shape)

    def residual(self, kin: Kinematics) -> Array:
        """(rows,) of all constraints."""
        return self._stack([c.residual(kin) for c in self.items], (0,))

    def jacobian(self, kin: Kinematics) -> Array:
        """(rows, nv) of all constraints."""
        return self._stack([c.jacobian(kin) for c in self.items], (0, self.mechanism.nv))

    def bias(self, kin: Kinematics) -> Array:
        """(rows,) dJ/dt v of all constraints."""
        return self._stack([c.bias(kin) for c in self.items], (0,))
