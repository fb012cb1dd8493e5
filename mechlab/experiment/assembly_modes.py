"""The assembly mode along a run: how often it changed, and a watch that stops the run where it changes.

The mode is the sign of det [independent rows of J; rows of the held joints; rows of local freedoms]. Where rows of the closure
repeat others, no choice of independent rows lasts; the sign is then followed from pose to pose (`mechlab.mechanism.followed_mode`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from mechlab.experiment.recording import Finding
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.followed_mode import followed_signs
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.many_states import ManyStates
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.state_rows import state_rows
from mechlab.mechanism.structure import independent_rows, rows_repeat, structure

MODE_SAMPLES = 200
MODE_POSES = 2000
"""Poses whose assembly mode is told at once."""


UNWATCHED = Finding("assembly_mode", 0.0, 0.0, "changes", "ok", "no drives: the assembly mode was not watched")
"""The finding of a run in which no joint is held."""


def mode_finding(mechanism: Mechanism, jacobian: Array, held: Sequence[str], strict: bool = False) -> Finding:
    """Finding "assembly_mode": how often the assembly mode for the held joints changed along a run with the constraint Jacobians
    (n, rows, nv).

    A change is a warning, as a free motion may pass through a toggle position; an error when `strict`. About
    MODE_SAMPLES samples are examined; MODE_POSES where the sign is followed from pose to pose; all when `strict`.
    """
    modes = _Modes(mechanism, held)
    wanted = MODE_POSES if modes.repeats else MODE_SAMPLES
    signs = modes.signs(jacobian if strict else jacobian[:: max(1, len(jacobian) // wanted)])
    known = signs[signs != 0]
    if not len(known):
        text = "the assembly mode cannot be told: the drives do not fix the mechanism"
        return Finding("assembly_mode", 0.0, 0.0, "changes", "ok", text)
    changes = int(np.count_nonzero(np.diff(known)))
    if changes:
        text = f"with respect to {', '.join(held)} the assembly mode changed {changes} times: a toggle was passed"
        if strict:
            text += (
                ", which the mechanism itself cannot do; the run stops here, do not trust it. Try a smaller timestep"
            )
        return Finding("assembly_mode", float(changes), 0.0, "changes", "error" if strict else "warning", text)
    return Finding("assembly_mode", 0.0, 0.0, "changes", "ok", f"the assembly mode of {', '.join(held)} was kept")


class ModeWatch:
    """Watches along a run whether the assembly mode with respect to the held joints is still that of the first state."""

    def __init__(self, mechanism: Mechanism, held: Sequence[str]) -> None:
        self.mechanism, self.held = mechanism, tuple(held)
        self._first = 0.0
        self._last: tuple[float, Array] | None = None
        self._modes = _Modes(mechanism, self.held) if self.held else None

    @cached_property
    def _equations(self) -> tuple[TreeKinematics, ConstraintSet]:
        return TreeKinematics(self.mechanism), ConstraintSet(self.mechanism)

    @property
    def watches(self) -> bool:
        """Whether there are held joints, so that `changed` may be True."""
        return self._modes is not None

    def changed(self, q: Array) -> bool:
        """True when the mode at q (nq,) differs from that of the first call; always False without held joints."""
        if self._modes is None or not np.all(np.isfinite(q)):
            return False
        tree, constraints = self._equations
        return self._first_other(self._signs(constraints.jacobian(tree.set(q))[None])) is not None

    def first_change(self, q: Array) -> int | None:
        """Index of the first of several poses q (n, nq) for which `changed` is True; None where there is none."""
        if self._modes is None or not len(q):
            return None
        jacobians = state_rows(self.mechanism).jacobian(ManyStates(self.mechanism, q))
        signs = self._signs(jacobians)
        return self._first_other(np.where(np.isfinite(q).all(axis=1), signs, 0.0))

    def _signs(self, jacobians: Array) -> Array:
        """(n,) signs; where they are followed from pose to pose, they go on from the last pose of the calls before."""
        assert self._modes is not None
        if not self._modes.repeats:
            return self._modes.signs(jacobians)
        sign, last = self._last or (1.0, jacobians[0])
        signs = self._modes.signs(np.concatenate([last[None], jacobians]))
        signs = signs * (sign * signs[0] if signs[0] else 1.0)
        told = np.flatnonzero(signs[1:])
        if len(told):
            self._last = float(signs[1 + told[-1]]), jacobians[told[-1]]
        return signs[1:]

    def _first_other(self, signs: Array) -> int | None:
        """Index of the first sign that is opposite to the first one of all calls that was not 0."""
        if not self._first:
            self._first = float(next((x for x in signs if x), 0.0))
        other = np.flatnonzero(self._first * signs < 0.0)
        return int(other[0]) if len(other) else None


class _Modes:
    """Computes the signs of `mode_signs`; everything that does not depend on the pose is computed once. `repeats`: rows repeat
    others, and the signs are followed from pose to pose."""

    def __init__(self, mechanism: Mechanism, held: Sequence[str]) -> None:
        self.keep = independent_rows(mechanism, ConstraintSet(mechanism))
        self.repeats = rows_repeat(mechanism)
        rows = [mechanism.row(n) for n in held]
        if len(self.keep) + len(rows) < mechanism.nv and structure(mechanism).idle:
            rows += _idle_rows(mechanism, held)
        self.square = len(self.keep) + len(rows) == mechanism.nv
        self.tail = np.array(rows).reshape(len(rows), mechanism.nv)
        self.constant = not (mechanism.loops or mechanism.curves)

    def signs(self, jacobian: Array) -> Array:
        """(n,) signs of the determinants with the constraint Jacobians (n, rows, nv) along a path; 0 where the matrix is not square
        or is singular."""
        if not self.square:
            return np.zeros(len(jacobian))
        if self.constant and len(jacobian) > 1:  # the rows of relations are the same in every pose
            return np.repeat(self.signs(jacobian[:1]), len(jacobian))
        if self.repeats:
            return followed_signs(jacobian, self.tail)
        tails = np.broadcast_to(self.tail, (len(jacobian), *self.tail.shape))
        sign, size = np.linalg.slogdet(np.concatenate([jacobian[:, self.keep], tails], axis=1))
        return np.where(size > -60, sign, 0.0)


def mode_signs(mechanism: Mechanism, q: Array, held: Sequence[str]) -> Array:
    """(..., n) sign of det [independent rows of J; rows of the held joints; rows of local freedoms] along paths q (..., n, nq).

    0 where the matrix is not square or is singular. As `mechlab.mechanism.mode_sign`, but local freedoms are fixed too, and where
    rows repeat others the sign is followed along each path (`followed_signs`).
    """
    modes, rows = _Modes(mechanism, held), state_rows(mechanism)
    out = np.zeros(q.shape[:-1])
    if not modes.square:
        return out
    paths = q.reshape(-1, q.shape[-2], q.shape[-1]) if modes.repeats else q.reshape(-1, 1, q.shape[-1])
    signs, some = out.reshape(paths.shape[:2]), max(1, MODE_POSES // max(paths.shape[1], 1))
    for i in range(0, len(paths), some):
        part = paths[i : i + some]
        jacobians = rows.jacobian(ManyStates(mechanism, part.reshape(-1, q.shape[-1])))
        if modes.repeats:
            signs[i : i + some] = modes.signs(jacobians.reshape(*part.shape[:2], *jacobians.shape[1:]))
        else:
            signs[i : i + some, 0] = modes.signs(jacobians)
    return out


def _idle_rows(mechanism: Mechanism, held: Sequence[str]) -> list[Array]:
    """Unit rows (nv,) of independent rates that are not held, one for each local freedom."""
    best = structure(mechanism)
    names = list(mechanism.rate_names)
    free = [n for n in best.independent if n not in held and n in names]
    return [np.eye(mechanism.nv)[names.index(n)] for n in free[: len(best.idle)]]
