"""Assembly and inverse kinematics on Pinocchio: closes the loops and gives joints, shafts and frames their values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mechlab.mechanism.assembly import Assembly, Status, follow, newton
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import integrate
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.structure import independent_rows, singularity, structure
from mechlab.solve.constraints import PinConstraints
from mechlab.solve.kinematics import PinKinematics
from mechlab.solve.quantities import Quantities, check_target, interpolate

SINGULAR = 1e-6
NEAR = 0.05
"""Moves smaller than this [rad or m] stay in one assembly mode."""


@dataclass(frozen=True)
class Solved(Assembly):
    """An Assembly with what one wants to know of it: `gap` by row or target that stays open, kinds of singularity
    ("constraint", "parallel", "serial"), the smallest singular value of the equations (rows of unit length)."""

    gap: tuple[tuple[str, float], ...] = ()
    singularities: tuple[str, ...] = ()
    smallest: float = float("nan")

    @property
    def closed(self) -> bool:
        """True when the residual is at rounding level, at a singular position too."""
        return self.status in (Status.SOLVED, Status.BOUNDARY)

    @property
    def sentence(self) -> str:
        """The status in words, with the kinds of singularity or what stays open."""
        if self.singularities and self.closed:
            return f"{self.status.value} ({', '.join(self.singularities)})"
        if self.gap and not self.closed:
            return f"{self.status.value}: " + ", ".join(f"{n} is missed by {g:.3g}" for n, g in self.gap)
        return self.status.value


class Closer:
    """The closure equations of a mechanism with given targets; keeps its workspace for many solutions."""

    def __init__(self, mechanism: Mechanism, names: Sequence[str]) -> None:
        self.mechanism = mechanism
        self.kin = PinKinematics(mechanism)
        self.constraints = PinConstraints(self.kin)
        self.quantities = Quantities(self.kin, list(names))
        self.names = tuple(names)

    def evaluate(self, q: Array, targets: Sequence[ArrayLike]) -> tuple[Array, Array]:
        """(m,) residual and (m, nv) Jacobian of closure and targets."""
        self.kin.set(q)
        residual, jacobian, _ = self.constraints.evaluate()
        if not self.names:
            return residual, jacobian
        items = self.quantities.items
        off = [self.quantities.difference(i, x) for i, x in zip(items, targets, strict=True)]
        return np.concatenate([residual, *off]), np.concatenate([jacobian, self.quantities.jacobian()])

    def values(self, q: Array) -> list[Array | float]:
        """Present values of the targets."""
        self.kin.set(q)
        return [self.quantities.value(i) for i in self.quantities.items]

    def same_mode(self, before: Array, after: Array) -> bool:
        """False when the determinant of [closure; targets; local freedoms] has another sign at two poses: between them
        lies a position where two modes meet. True too when the sign cannot tell (the matrix is not square)."""
        if float(np.max(np.abs(before - after), initial=0.0)) < NEAR:
            return True
        a, b = self._mode(before), self._mode(after)
        return a == 0.0 or b == 0.0 or a == b

    def _mode(self, q: Array) -> float:
        self.kin.set(q)
        jacobian = self.constraints.evaluate()[1]
        matrix = np.concatenate([jacobian[self._independent], self.quantities.jacobian(), self._local])
        if matrix.shape[0] != matrix.shape[1]:
            return 0.0
        sign, size = np.linalg.slogdet(matrix)
        return float(sign) if size > -60 else 0.0

    @cached_property
    def _independent(self) -> list[int]:
        return independent_rows(self.mechanism, ConstraintSet(self.mechanism))

    @cached_property
    def _local(self) -> Array:
        """Rows that hold the local freedoms, where the targets do not."""
        m = self.mechanism
        free = [n for n in structure(m).independent if n in m.rate_names and n not in self.names]
        free = [n for n in free if n not in {d.on for d in m.drives}][: len(structure(m).idle)]
        return np.eye(m.nv)[[m.rate_names.index(n) for n in free]]

    def row_names(self) -> list[str]:
        """A name for each residual."""
        return list(self.constraints.rows) + [i.name for i in self.quantities.items for _ in range(i.rows)]

    def step(self, q: Array, dv: Array) -> Array:
        """q moved by dv."""
        return integrate(self.mechanism, q, dv)


def assemble(
    mechanism: Mechanism | Closer,
    given: Mapping[str, ArrayLike] | None = None,
    start: ArrayLike | None = None,
    *,
    steps: int = 1,
    output: str | None = None,
    keep_mode: bool = True,
    watch: bool = True,
) -> Solved:
    """Coordinates that close everything and give the quantities in `given` their values, by Newton from `start` (nq,).

    given: joints and shafts (physical values), FRAME_x, _y, _z [m], FRAME_rotation (a (3, 3) matrix). start: the
    reference pose by default. steps > 1: along a path from the values at the start, so that the assembly mode is kept
    far away too. A Closer instead of the mechanism saves its construction when one asks often.

    Status: SOLVED; BOUNDARY, solved at a singular position, `singularities` says which kinds (with `output`, a frame,
    also "serial": a direction of that frame's motion is lost); OUT_OF_REACH or (drives given only) NO_ASSEMBLY: the
    residual has a minimum that is not zero, `gap` says which rows stay open and by how much; WRONG_MODE;
    CHANGE_POINT; NOT_CONVERGED. `watch` = False skips the singularity. Raises MechlabError for an unknown name or a
    target that makes no sense.
    """
    closer = mechanism if isinstance(mechanism, Closer) else Closer(mechanism, list(given or {}))
    m = closer.mechanism
    targets = [(given or {})[n] for n in closer.names]
    for item, target in zip(closer.quantities.items, targets, strict=True):
        check_target(item, target)
    first = m.reference() if start is None else np.array(start, dtype=float)
    found = _search(closer, targets, first, steps, keep_mode)
    if not found.closed:
        return found if found.status is Status.WRONG_MODE else _unsolved(closer, targets, found)
    solved = Solved(found.q, found.residual, found.iterations, Status.SOLVED)
    return _watched(closer, solved, output) if watch else solved


def _search(closer: Closer, targets: Sequence[ArrayLike], first: Array, steps: int, keep_mode: bool) -> Solved:
    """Newton; and the path from the start, when it is asked for, or Newton fails or lands in another mode."""
    tried: list[Assembly] = []
    if steps <= 1:
        direct = newton(lambda x: closer.evaluate(x, targets), closer.step, first)
        if direct.closed and (not keep_mode or closer.same_mode(first, direct.q)):
            return _as_solved(direct)
        tried.append(direct)
    begin_at = newton(lambda x: closer.evaluate(x, closer.values(x)), closer.step, first)
    if begin_at.closed and closer.names:
        path = _path(closer, closer.values(begin_at.q), targets)
        along = follow(path, closer.step, begin_at.q, steps=max(steps, 10))
        if along.closed and (not keep_mode or closer.same_mode(begin_at.q, along.q)):
            return _as_solved(along)
        tried.append(along)
    if any(x.closed for x in tried):
        wrong = next(x for x in tried if x.closed)
        return Solved(wrong.q, wrong.residual, wrong.iterations, Status.WRONG_MODE)
    return _as_solved(tried[-1]) if tried else _as_solved(begin_at)


def _as_solved(found: Assembly) -> Solved:
    return Solved(found.q, found.residual, found.iterations, found.status)


def _path(
    closer: Closer, begin: Sequence[Array | float], targets: Sequence[ArrayLike]
) -> Callable[[Array, float], tuple[Array, Array]]:
    items = closer.quantities.items

    def evaluate(x: Array, s: float) -> tuple[Array, Array]:
        wanted = [interpolate(i, a, b, s) for i, a, b in zip(items, begin, targets, strict=True)]
        return closer.evaluate(x, wanted)

    return evaluate


def _watched(closer: Closer, solved: Solved, output: str | None) -> Solved:
    """The solution with its singularities: a cheap look at the smallest singular value first, the kinds when it is
    small."""
    m = closer.mechanism
    closer.kin.set(solved.q)
    jacobian = np.concatenate([closer.constraints.evaluate()[1], closer.quantities.jacobian()])
    smallest, rank = _smallest(jacobian)
    rows = None
    if output is not None:
        frame = m.frame(output)
        rotation, origin = closer.kin.pose(frame.body)
        rows = closer.kin.jacobian(frame.body, origin + rotation @ frame.placement.translation)
    if rank == min(jacobian.shape) and smallest > 1e-3 and rows is None:
        return replace(solved, smallest=smallest)
    kinds = singularity(m, solved.q, rows, SINGULAR)
    if smallest < SINGULAR and not kinds:
        kinds = ("serial",)
    status = Status.BOUNDARY if kinds else Status.SOLVED
    return replace(solved, smallest=smallest, singularities=kinds, status=status)


def _smallest(jacobian: Array) -> tuple[float, int]:
    """Smallest singular value above rounding of the matrix with rows of unit length, and the rank."""
    if not jacobian.size:
        return 1.0, 0
    norms = np.sqrt(np.einsum("ij,ij->i", jacobian, jacobian))
    values = np.linalg.svd(jacobian / np.where(norms > 1e-14, norms, 1.0)[:, None], compute_uv=False)
    kept = values[values > 1e-9 * values[0]]
    return float(kept[-1]), len(kept)


def _unsolved(closer: Closer, targets: Sequence[ArrayLike], found: Solved) -> Solved:
    """Why the search stalled: looks for the least residual nearby (Levenberg-Marquardt)."""
    q, residual, stationary = _least(closer, targets, found.q)
    names = closer.row_names()
    order = np.argsort(-np.abs(residual))[:3]
    gap = tuple((names[i], float(abs(residual[i]))) for i in order if abs(residual[i]) > 1e-9)
    size = float(np.max(np.abs(residual), initial=0.0))
    if not stationary:
        return Solved(q, size, found.iterations, Status.NOT_CONVERGED, gap)
    drives = {d.on for d in closer.mechanism.drives}
    unreachable = Status.NO_ASSEMBLY if set(closer.names) <= drives else Status.OUT_OF_REACH
    return Solved(q, size, found.iterations, unreachable, gap)


def _least(closer: Closer, targets: Sequence[ArrayLike], q: Array, iterations: int = 200) -> tuple[Array, Array, bool]:
    """Least |r| near q by Levenberg-Marquardt, the residual there, and True when it is a minimum and not zero.

    At such a minimum J^T r = 0 with r not zero: J has lost rank in the very direction that is asked for.
    """
    damping = 1e-3
    residual, jacobian = closer.evaluate(q, targets)
    for _ in range(iterations):
        gradient = jacobian.T @ residual
        size = float(np.linalg.norm(residual))
        if size < 1e-12 or float(np.linalg.norm(gradient)) < 1e-9 * size * max(1.0, float(np.linalg.norm(jacobian))):
            break
        normal = jacobian.T @ jacobian
        dv = np.asarray(np.linalg.solve(normal + damping * np.eye(len(normal)), -gradient), dtype=float)
        dv *= min(1.0, 0.5 / max(float(np.max(np.abs(dv))), 1e-300))
        trial = closer.step(q, dv)
        new, new_jacobian = closer.evaluate(trial, targets)
        if float(np.linalg.norm(new)) < size:
            q, residual, jacobian = trial, new, new_jacobian
            damping = max(damping / 5.0, 1e-12)
        else:
            damping *= 4.0
            if damping > 1e8:
                break
    size = float(np.linalg.norm(residual))
    flat = float(np.linalg.norm(jacobian.T @ residual)) < 1e-6 * size * max(1.0, float(np.linalg.norm(jacobian)))
    return q, residual, bool(flat and size > 1e-10)
