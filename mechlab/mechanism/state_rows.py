"""Residual, Jacobian and bias of all constraints at P states at once, over `ManyStates`; rows in the order of `ConstraintSet`.

Offset rows u . (p_b - p_a) and angle rows u . w_b of loops, lengths of rods, linear relations and curves: the same numbers as of
`mechlab.mechanism.constraints`, which takes one state.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from mechlab.mechanism.constraints import _LOOP_TABLE, AXES, ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_states import Indices, ManyStates, crossed, dot, products, state_tree
from mechlab.mechanism.model import Mechanism


class StateRows:
    """The constraint rows of a Mechanism, prepared: `count` of them, whose kinds and places are known."""

    def __init__(self, mechanism: Mechanism) -> None:
        m = self.mechanism = mechanism
        tree, constraints = state_tree(m), ConstraintSet(m)
        at = {name: s.start for name, s in constraints.slices.items()}
        self.count = len(constraints)
        loops, rods = [x for x in m.loops if x.kind != "distance"], [x for x in m.loops if x.kind == "distance"]
        self.a, self.b = (tree.points([(getattr(x, f"body_{e}"), getattr(x, f"placement_{e}").translation) for x in loops]) for e in "ab")
        self.turn_a, self.turn_b = (
            np.array([tree.place[getattr(x, f"body_{e}")][1] @ getattr(x, f"placement_{e}").rotation for x in loops]).reshape(-1, 3, 3)
            for e in "ab"
        )
        offsets, angles = [], []
        for i, x in enumerate(loops):
            row = at[x.name]
            for u in _LOOP_TABLE[x.kind][0]:
                offsets.append((row, i, AXES.index(u)))
                row += 1
            for u, w in _LOOP_TABLE[x.kind][1]:
                angles.append((row, i, AXES.index(u), AXES.index(w)))
                row += 1
        self.offsets, self.angles = _columns(offsets, 3), _columns(angles, 4)
        self.pairs = tree.between(self.a[0], self.b[0])
        self.offset_pairs, self.angle_pairs = _joined(self.offsets[1], self.pairs[0]), _joined(self.angles[1], self.pairs[0])
        self.rod_a, self.rod_b = (
            tree.points([(getattr(x, f"body_{e}"), getattr(x, f"placement_{e}").translation) for x in rods]) for e in "ab"
        )
        self.rods, self.lengths = np.array([at[x.name] for x in rods], dtype=int), np.array([x.length for x in rods])
        self.rod_pairs = tree.between(self.rod_a[0], self.rod_b[0])
        self.linked = np.array([at[x.name] for x in m.relations], dtype=int)
        self.relations = np.array([m.coefficient_row(x.coefficients) for x in m.relations]).reshape(-1, m.nv)
        self.curves = [
            (at[x.name], x.curve, m.zero(x.output), m.zero(x.input), m.q_slice[x.output].start, m.q_slice[x.input].start,
             m.v_slice[x.output].start, m.v_slice[x.input].start) for x in m.curves
        ]  # fmt: skip

    def _axes(self, states: ManyStates) -> tuple[Array, Array]:
        """(loops, 3, 3, P) rotations of the two ends to the world."""
        ends = ((self.a[0], self.turn_a), (self.b[0], self.turn_b))
        first, second = (products(states.rotations[links], turn[..., None]) for links, turn in ends)
        return first, second

    def residual(self, states: ManyStates) -> Array:
        """(P, rows) of m and sines."""
        out = np.zeros((self.count, len(states.q)))
        if len(self.a[0]):
            ra, rb = self._axes(states)
            (row, i, u), (turned, j, x, y) = self.offsets, self.angles
            out[row] = dot(ra[i, :, u], (states.positions(self.b) - states.positions(self.a))[i])
            out[turned] = dot(ra[j, :, x], rb[j, :, y])
        if len(self.rods):
            d = states.positions(self.rod_b) - states.positions(self.rod_a)
            out[self.rods] = 0.5 * (dot(d, d) / self.lengths[:, None] - self.lengths[:, None])
        if len(self.linked):
            out[self.linked] = self.relations @ states.q[:, self.mechanism.q_columns].T
        for row, curve, zero_b, zero_a, b, a, _, _ in self.curves:
            out[row] = zero_b + states.q[:, b] - curve.many(zero_a + states.q[:, a])[0]
        return out.T

    def jacobian(self, states: ManyStates) -> Array:
        """(P, rows, nv)."""
        count, nv = len(states.q), self.mechanism.nv
        out, (s, w) = np.zeros((self.count, nv, count)), states.screws
        if len(self.a[0]):
            ra, rb = self._axes(states)
            pairs, rates, signs = self.pairs
            # velocity relative to the point of A that coincides with the point of B, which takes in the rotation of A
            moved = signs[:, None, None] * (s[rates] + crossed(w[rates], states.positions(self.b)[pairs]))
            which, pair = self.offset_pairs
            row, i, u = (x[which] for x in self.offsets)
            out[row, rates[pair]] = dot(ra[i, :, u], moved[pair])
            if len(self.angles[0]):
                which, pair = self.angle_pairs
                row, i, x, y = self.angles
                normal = crossed(rb[i, :, y], ra[i, :, x])
                out[row[which], rates[pair]] = signs[pair][:, None] * dot(normal[which], w[rates[pair]])
        if len(self.rods):
            pairs, rates, signs = self.rod_pairs
            pb = states.positions(self.rod_b)
            along = (pb - states.positions(self.rod_a)) / self.lengths[:, None, None]
            # both ends lie on the line of the rod, so the velocity of A along it may be taken at B
            out[self.rods[pairs], rates] = signs[:, None] * dot(along[pairs], s[rates] + crossed(w[rates], pb[pairs]))
        if len(self.linked):
            out[self.linked] = self.relations[..., None]
        for row, curve, _, zero_a, _, a, out_v, in_v in self.curves:
            out[row, out_v] = 1.0
            out[row, in_v] = -curve.many(zero_a + states.q[:, a])[1]
        return np.ascontiguousarray(out.transpose(2, 0, 1))

    def bias(self, states: ManyStates) -> Array:
        """(P, rows) dJ/dt v."""
        out = np.zeros((self.count, len(states.q)))
        if len(self.a[0]):
            ra, rb = self._axes(states)
            pb = states.positions(self.b)
            va, wa, aa, ba = states.motion(self.a[0], pb)
            vb, wb, ab, bb = states.motion(self.b[0], pb)
            # the point of A that coincides with that of B changes as B moves on A; the axes of A turn
            own = ab - aa - 2.0 * crossed(wa, vb - va)
            row, i, u = self.offsets
            out[row] = dot(ra[i, :, u], own[i])
            if len(self.angles[0]):
                row, i, x, y = self.angles
                u, w, wa, wb, bent = ra[i, :, x], rb[i, :, y], wa[i], wb[i], (bb - ba)[i]
                change = crossed(crossed(wb, w), u) + crossed(w, crossed(wa, u))
                out[row] = dot(change, wb - wa) + dot(crossed(w, u), bent)
        if len(self.rods):
            pa, pb = states.positions(self.rod_a), states.positions(self.rod_b)
            va, _, aa, _ = states.motion(self.rod_a[0], pa)
            vb, _, ab, _ = states.motion(self.rod_b[0], pb)
            out[self.rods] = (dot(vb - va, vb - va) + dot(pb - pa, ab - aa)) / self.lengths[:, None]
        for row, curve, _, zero_a, _, a, _, rate in self.curves:
            out[row] = -curve.many(zero_a + states.q[:, a])[2] * states.v[:, rate] ** 2
        return out.T


@lru_cache(maxsize=32)
def state_rows(mechanism: Mechanism) -> StateRows:
    """The prepared rows of a Mechanism, made once."""
    return StateRows(mechanism)


def _columns(rows: Sequence[tuple[int, ...]], width: int) -> Indices:
    return np.array(rows, dtype=int).reshape(-1, width).T


def _joined(loops: Indices, pairs: Indices) -> tuple[Indices, Indices]:
    """All (row, pair) of which both are of the same loop: places in `loops` (rows,) and in `pairs` (n,)."""
    first, second = np.nonzero(loops[:, None] == pairs)
    return first, second
