"""Closing equations of a mechanism and rows of given quantities at many poses at once: what depends only on the structure is kept.

    r(q) = [loops and relations; value - target of every given quantity] = 0

Given are joints and shafts (physical values), FRAME_x, FRAME_y, FRAME_z [m], and FRAME_rotation ((3, 3), frame axes to world; three
rows, the rotation vector from the target to the value). Rows that repeat others are left out of the Newton step, not of the check.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.batch_sparse import smallest_of_rows
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.mechanism.followed_mode import followed_signs
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_motion import frame_part
from mechlab.mechanism.many_poses import ManyPoses, matrices, rotation_vectors
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.one_pose import OnePose
from mechlab.mechanism.parts import Frame
from mechlab.mechanism.small_systems import lapack
from mechlab.mechanism.structure import CERTAIN, generic, structure

Indices = NDArray[np.int_]
VOID = 1e-12
"""Size of a row below which no motion changes it."""
INDEPENDENT = 1e-8
"""Share of a row beyond which it does not repeat the rows chosen before it."""
PARTS = ("x", "y", "z", "rotation")


@dataclass(frozen=True)
class Placed:
    """The equations at n poses: gap (n, c) of loops and relations; values of the given quantities, each (n,) or (n, 3, 3); rows
    (n, m, nv): Jacobian of the gap, then of the values."""

    gap: Array
    values: tuple[Array, ...]
    rows: Array

    def at(self, which: Any) -> Placed:
        """The same at some of the poses."""
        return Placed(self.gap[which], tuple(x[which] for x in self.values), self.rows[which])

    def put(self, which: Any, other: Placed) -> None:
        """Take over other poses."""
        self.gap[which], self.rows[which] = other.gap, other.rows
        for mine, theirs in zip(self.values, other.values, strict=True):
            mine[which] = theirs


class ManyRows:
    """The equations of a mechanism with the given names, by numpy alone. Raises MechlabError that lists the names."""

    def __init__(self, mechanism: Mechanism, names: Sequence[str]) -> None:
        m = self.mechanism = mechanism
        self.names = tuple(names)
        self._frames: dict[str, tuple[Frame, str]] = {}
        for name in self.names:
            if name not in m.scalar_names:
                self._frames[name] = _position_part(m, name)
        self._scalars = np.array([m.row(n) for n in self.names if n not in self._frames]).reshape(-1, m.nv)
        self._zeros = np.array([m.zero(n) for n in self.names if n not in self._frames])
        simple = not self._frames and all(j.nv == 1 for j in m.joints)
        self._batch = BatchRows(BatchTree(m)) if simple else None
        self._poses = None if simple else ManyPoses(m)

    def at(self, q: Array) -> Placed:
        """The equations at coordinates q (n, nq)."""
        if self._batch is not None:
            gap, rows = self._batch.evaluate(q)
        else:
            assert self._poses is not None
            gap, rows = self._poses.set(q).residual_and_jacobian()
        if not self.names:
            return Placed(gap, (), rows)
        scalars = self._zeros + q[:, self.mechanism.q_columns] @ self._scalars.T
        plain = np.broadcast_to(self._scalars, (len(q), *self._scalars.shape))
        if not self._frames:
            return Placed(gap, tuple(scalars.T), np.concatenate([rows, plain], axis=1))
        values: list[Array] = []
        blocks, k = [rows], 0
        for name in self.names:
            if name in self._frames:
                value, block = self._frame(*self._frames[name])
            else:
                value, block = scalars[:, k], plain[:, k : k + 1]
                k += 1
            values.append(value)
            blocks.append(block)
        return Placed(gap, tuple(values), np.concatenate(blocks, axis=1))

    def one(self, q: Array, targets: Sequence[Any] | Array) -> tuple[Array, Array]:
        """(m,) residual and (m, nv) Jacobian at one pose q (nq,), in the fewest calls."""
        if self._alone is not None:
            return self._alone.evaluate(q, self._zeros - targets)
        placed = self.at(q[None])
        return self.missing(placed, [np.asarray(x, dtype=float)[None] for x in targets])[0], placed.rows[0]

    def residual_of_one(self, q: Array, targets: Sequence[Any]) -> Array:
        """(m,) the residual of `one` alone."""
        return self.one(q, targets)[0] if self._alone is None else self._alone.residual(q, self._zeros - targets)

    @cached_property
    def _alone(self) -> OnePose | None:
        """One pose at a time, where all joints have one coordinate and no curve couples them."""
        return None if self._batch is None or self._batch.curves else OnePose(self._batch, self._scalars)

    def _frame(self, frame: Frame, part: str) -> tuple[Array, Array]:
        assert self._poses is not None
        rotation, origin = self._poses.frame(frame.body)
        point = origin + rotation @ frame.placement.translation
        linear, angular = self._poses.motion(frame.body, point)
        if part == "rotation":
            return rotation @ frame.placement.rotation, np.swapaxes(angular, 1, 2)
        i = "xyz".index(part)
        return point[:, i], linear[:, None, :, i]

    def missing(self, placed: Placed, targets: Sequence[Array]) -> Array:
        """(n, m) residual with the targets, each as the values of `Placed`."""
        off = [placed.gap]
        for value, target in zip(placed.values, targets, strict=True):
            if value.ndim == 3:
                off.append(rotation_vectors(quaternions(value @ np.swapaxes(target, 1, 2))))
            else:
                off.append((value - target)[:, None])
        return np.concatenate(off, axis=1)

    def targets(self, given: Mapping[str, Any], count: int) -> tuple[Array, ...]:
        """The given values at `count` poses, in the order of the names. Raises MechlabError for what is not finite or has a wrong
        shape."""
        out = []
        for name in self.names:
            shape = (3, 3) if self._frames.get(name, (None, ""))[1] == "rotation" else ()
            array = np.asarray(given[name], dtype=float)
            if not np.all(np.isfinite(array)) or array.shape not in (shape, (count, *shape)):
                what = "a finite (3, 3) rotation" if shape else "a finite number"
                raise MechlabError(
                    f"{self.mechanism.name}: {name}: expected {what} or an array of {count}, got {given[name]!r}."
                )
            out.append(np.broadcast_to(array, (count, *shape)))
        return tuple(out)

    @cached_property
    def steps(self) -> NewtonSteps:
        """The Newton steps of these equations."""
        placed = self.at(generic(self.mechanism)[0][None])
        return NewtonSteps(placed.rows[0], held_rows(self.mechanism, self.names), placed.gap.shape[1])


class NewtonSteps:
    """Newton steps of equations whose rows may repeat each other: which rows are kept is decided once, at a generic pose.

    The step is the smallest that takes the residual of the kept rows away; where rows repeat others and all together fix every rate
    (Bricard's linkage), which rows do changes on the way, and the step is that of least squares over all. rows (m, n): Jacobian at a
    generic pose, the first `closure` of them (default all) those of loops and relations; held (k, n): rows that hold local freedoms,
    for the sign of the mode.
    """

    def __init__(self, rows: Array, held: Array, closure: int | None = None) -> None:
        norms = np.linalg.norm(rows, axis=1)
        self.keep = independent(rows)
        self.repeats = bool(np.any(np.delete(norms, self.keep) > VOID))
        self.square = len(self.keep) == rows.shape[1]
        self.tall = self.square and self.repeats
        self._closure, self._local = len(rows) if closure is None else closure, held
        self._rows = np.flatnonzero(norms > VOID) if self.tall else self.keep
        self._sizes = norms[self._rows]
        self.count, self._unit = len(rows), np.eye(rows.shape[1])
        self._all = len(self._rows) == self.count
        self._held = held if len(self.keep) + len(held) == rows.shape[1] else None

    @cached_property
    def _solve(self) -> Callable[..., tuple[Array, Array, Array, int]]:
        return lapack().dgesv

    def inverse(self, rows: Array) -> Array:
        """(..., n, k) such that the step is -inverse @ the residuals of the rows that count; NaN where they are exactly singular. rows
        (..., m, n)."""
        kept = rows if self._all else rows[..., self._rows, :]
        if self.square and not self.tall:
            return inverted(kept)
        kept = kept / self._sizes[:, None]
        across = np.swapaxes(kept, -1, -2)
        if self.tall:
            return np.asarray(inverted(across @ kept) @ across / self._sizes)
        return np.asarray(across @ inverted(kept @ across) / self._sizes)

    def inverse_of_one(self, rows: Array) -> Array:
        """(n, m) such that the step of one pose is -inverse @ its residuals, all of them; rows (m, n). As `inverse`, in fewer calls."""
        if self.square and not self.tall:
            kept = rows if self._all else rows.take(self._rows, 0)
            _, _, found, singular = self._solve(kept, self._unit)
            found = np.full_like(found, np.nan) if singular else found
        else:
            found = self.inverse(rows)
        if self._all:
            return np.asarray(found)
        out = np.zeros((len(found), self.count))
        out[:, self._rows] = found
        return out

    def step(self, inverse: Array, residual: Array) -> Array:
        """(..., n) Newton steps for residuals (..., m)."""
        kept = residual if self._all else residual[..., self._rows]
        return np.asarray(-(inverse @ kept[..., None])[..., 0])

    def modes(self, rows: Array) -> Array:
        """(...) sign of the determinant of the kept rows and those that hold local freedoms: it changes where two assembly modes
        meet. 0 where they are not square, or near singular, and the sign cannot tell; or where rows repeat others (`same_mode`)."""
        if self._held is None or self.repeats:
            return np.zeros(rows.shape[:-2])
        return _signs(rows if self._all and self.square else rows[..., self.keep, :], self._held)

    def stays(self, inverse: Array, rows: Array) -> bool:
        """Whether the determinant surely has the sign that it has where `inverse` (n, m) of one pose is that of the rows: |inverse rows
        - 1| < 1, so that no matrix between the two is singular. One pose, rows (m, n); False where no rows are square by themselves."""
        if not self.square or self.tall:
            return False
        change = (inverse.dot(rows) - self._unit).ravel()
        return float(change.dot(change)) < 1.0

    def same_mode(self, before: Array, after: Array) -> NDArray[np.bool_]:
        """(...) whether near poses, rows (..., m, n), are in one mode, where rows repeat others: the sign is followed from pose to
        pose; True where it cannot tell."""
        both = np.stack([before, after], axis=-3)
        local = np.broadcast_to(self._local, (*both.shape[:-2], *self._local.shape))
        fixed = np.concatenate([both[..., self._closure :, :], local], axis=-2)
        signs = followed_signs(both[..., : self._closure, :], fixed)
        return np.asarray(signs[..., 0] * signs[..., 1] >= 0.0)


def independent(rows: Array) -> Indices:
    """Indices, rising, of rows (m, n) that span all of them: the largest remainder is chosen next, rows measured by their size."""
    norms = np.linalg.norm(rows, axis=1)
    rest = rows / np.where(norms > VOID, norms, np.inf)[:, None]
    smallest = smallest_of_rows(rest[None])
    if smallest is not None and smallest[0] > CERTAIN:  # of a large mechanism: all that are not void
        return np.flatnonzero(norms > VOID)
    kept: list[int] = []
    while len(kept) < min(rows.shape):
        sizes = np.linalg.norm(rest, axis=1)
        k = int(np.argmax(sizes))
        if sizes[k] < INDEPENDENT:
            break
        kept.append(k)
        along = rest[k] / sizes[k]
        for _ in range(2):  # twice is enough against rounding
            rest = rest - np.outer(rest @ along, along)
    return np.array(sorted(kept), dtype=int)


def _signs(rows: Array, more: Array) -> Array:
    """(...) sign of det of [rows; more], rows (..., k, n) and more (n - k, n); 0 near zero."""
    if len(more):
        rows = np.concatenate([rows, np.broadcast_to(more, (*rows.shape[:-2], *more.shape))], axis=-2)
    sign, size = np.linalg.slogdet(rows)
    return np.where(size > -60.0, sign, 0.0)


def held_rows(mechanism: Mechanism, names: Sequence[str]) -> Array:
    """(k, nv) rows that hold the local freedoms, where the given names do not."""
    found = structure(mechanism)
    driven = {d.on for d in mechanism.drives}
    free = [n for n in found.independent if n in mechanism.rate_names and n not in names and n not in driven]
    return np.eye(mechanism.nv)[[mechanism.rate_names.index(n) for n in free[: len(found.idle)]]]


def between(begin: Sequence[Array], end: Sequence[Array], s: Array) -> list[Array]:
    """The targets on the way from `begin` (s = 0) to `end` (s = 1), s (n,): straight lines, and turns about one axis."""
    out = []
    for a, b in zip(begin, end, strict=True):
        if a.ndim == 3:
            turn = rotation_vectors(quaternions(b @ np.swapaxes(a, 1, 2)))
            turned = matrices(exponentials(s[:, None] * turn)) @ a
            out.append(np.where((s == 1.0)[:, None, None], b, turned))
        else:
            out.append(np.where(s == 1.0, b, a + s * (b - a)))
    return out


def exponentials(vectors: Array) -> Array:
    """(n, 4) quaternions w, x, y, z of rotation vectors (n, 3) [rad]."""
    angle = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.hstack([np.cos(0.5 * angle), 0.5 * np.sinc(angle / (2.0 * np.pi)) * vectors])


def quaternions(rotations: Array) -> Array:
    """(n, 4) unit quaternions w, x, y, z of rotations (n, 3, 3), by the largest of the four (Shepperd 1978)."""
    r = rotations
    trace = r[:, 0, 0] + r[:, 1, 1] + r[:, 2, 2]
    squares = np.stack([trace, r[:, 0, 0], r[:, 1, 1], r[:, 2, 2]], axis=1)
    a, b, c = r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]
    d, e, f = r[:, 0, 1] + r[:, 1, 0], r[:, 0, 2] + r[:, 2, 0], r[:, 1, 2] + r[:, 2, 1]
    one = np.ones(len(r))
    tables = np.stack([
        np.stack([one + trace, a, b, c], axis=1),
        np.stack([a, one + 2.0 * r[:, 0, 0] - trace, d, e], axis=1),
        np.stack([b, d, one + 2.0 * r[:, 1, 1] - trace, f], axis=1),
        np.stack([c, e, f, one + 2.0 * r[:, 2, 2] - trace], axis=1),
    ])  # fmt: skip
    chosen = tables[np.argmax(squares, axis=1), np.arange(len(r))]
    return np.asarray(chosen / np.linalg.norm(chosen, axis=1, keepdims=True))


def inverted(matrices: Array) -> Array:
    """(..., n, n) inverses; NaN for a matrix that is exactly singular or not finite."""
    try:
        return np.asarray(np.linalg.inv(matrices))
    except np.linalg.LinAlgError:
        out = np.full_like(matrices, np.nan)
        for k in np.ndindex(matrices.shape[:-2]):
            try:
                out[k] = np.linalg.inv(matrices[k])
            except np.linalg.LinAlgError:
                continue
        return np.asarray(out)


def _position_part(m: Mechanism, name: str) -> tuple[Frame, str]:
    frame, part = frame_part(m, name)
    if part not in PARTS:
        raise MechlabError(f"{name} is a rate of turning and has no value; give {frame.name}_rotation.")
    return frame, part
