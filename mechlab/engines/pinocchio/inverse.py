"""Assembly and inverse kinematics on Pinocchio: closes the loops and gives joints, shafts and frames their values.

A search that fails says why: out of reach, no assembly, or merely not converged (`verdict`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.closer import NEAR, Closer, kept_closer, path
from mechlab.engines.pinocchio.quantities import check_target
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, Status, follow, newton
from mechlab.mechanism.singularity import singularity

FOLD = 0.05
"""A path has met a fold when the smallest singular value fell below this share of that at its start."""


def verdict(
    closer: Closer, targets: Sequence[ArrayLike], first: Array, along: Assembly | None, stalled: Array
) -> tuple[Status, Array, tuple[tuple[str, float], ...], Array | None]:
    """Status, pose, what is missed there by name, and a pose that closes if one was found after all.

    Evidence: (1) the path from the start towards the targets ended at a fold: closed all the way, and the equations
    lost rank; (2) the least |r| near the end of the search is not zero (Levenberg-Marquardt): J has lost rank in the
    very direction that is asked for. Either makes it out of reach, or, when only drives are given, no assembly.
    """
    drives = {d.on for d in closer.mechanism.drives}
    unreachable = Status.NO_ASSEMBLY if set(closer.names) <= drives else Status.OUT_OF_REACH
    folded = along is not None and closer.smallest(along.q) < FOLD * closer.smallest(first)
    q, residual, minimum = _least(closer, targets, along.q if along is not None and folded else stalled)
    if float(np.max(np.abs(residual), initial=0.0)) < 1e-10:
        return Status.NOT_CONVERGED, q, (), q
    if along is not None and folded:
        return unreachable, along.q, _missed(closer, closer.evaluate(along.q, targets)[0]), None
    return unreachable if minimum else Status.NOT_CONVERGED, q, _missed(closer, residual), None


def _missed(closer: Closer, residual: Array) -> tuple[tuple[str, float], ...]:
    """The three largest residuals by name."""
    names = closer.row_names()
    order = np.argsort(-np.abs(residual))[:3]
    return tuple((names[i], float(abs(residual[i]))) for i in order if abs(residual[i]) > 1e-9)


def _least(closer: Closer, targets: Sequence[ArrayLike], q: Array, iterations: int = 80) -> tuple[Array, Array, bool]:
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


SINGULAR = 1e-6


@dataclass(frozen=True)
class Solved(Assembly):
    """An Assembly with its diagnosis: `gap` by row or target that stays open, kinds of singularity
    ("constraint", "parallel", "serial"), the smallest singular value of the equations."""

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
    far away too. The workspace is kept for the next question of the same kind; a Closer can be given instead of the
    mechanism.

    Status: SOLVED; BOUNDARY, solved at a singular position, `singularities` says which kinds (with `output`, a frame,
    also "serial": a direction of that frame's motion is lost); OUT_OF_REACH or (drives given only) NO_ASSEMBLY: the
    residual has a minimum that is not zero, `gap` says which rows stay open and by how much; WRONG_MODE;
    CHANGE_POINT; NOT_CONVERGED. `watch` = False skips the singularity. Raises MechlabError for an unknown name or a
    target that makes no sense.
    """
    closer = mechanism if isinstance(mechanism, Closer) else kept_closer(mechanism, tuple(given or {}))
    m = closer.mechanism
    targets = [(given or {})[n] for n in closer.names]
    for item, target in zip(closer.quantities.items, targets, strict=True):
        check_target(item, target)
    first = m.reference() if start is None else np.array(start, dtype=float)
    found = _search(closer, targets, first, steps, keep_mode)
    return _watched(closer, found, output) if watch and found.closed else found


def _search(closer: Closer, targets: Sequence[ArrayLike], first: Array, steps: int, keep_mode: bool) -> Solved:
    """Newton; and the path from the start, when it is asked for, or Newton fails or lands in another mode."""
    direct = newton(lambda x: closer.evaluate(x, targets), closer.step, first)
    near = float(np.max(np.abs(direct.q - first), initial=0.0)) < NEAR
    if direct.closed and (near or (steps <= 1 and (not keep_mode or closer.same_mode(first, direct.q)))):
        return _as_solved(direct)
    begin = newton(lambda x: closer.evaluate(x, closer.values(x)), closer.step, first)
    along: Assembly | None = None
    if begin.closed and closer.names:
        along = follow(path(closer, closer.values(begin.q), targets), closer.step, begin.q, steps=max(steps, 10))
        if along.closed and (not keep_mode or closer.same_mode(begin.q, along.q)):
            return _as_solved(along)
    for found in (along, direct):
        if found is not None and found.closed:
            return replace(_as_solved(found), status=Status.WRONG_MODE)
    status, q, missed, closed = verdict(closer, targets, begin.q, along, direct.q)
    size = float(np.max(np.abs(closer.evaluate(q, targets)[0]), initial=0.0))
    if closed is not None:
        again = newton(lambda x: closer.evaluate(x, targets), closer.step, closed)
        if again.closed:
            same = not keep_mode or closer.same_mode(begin.q, again.q)
            return replace(_as_solved(again), status=Status.SOLVED if same else Status.WRONG_MODE)
    return Solved(q, size, direct.iterations, status, missed)


def _as_solved(found: Assembly) -> Solved:
    return Solved(found.q, found.residual, found.iterations, found.status)


def _watched(closer: Closer, solved: Solved, output: str | None) -> Solved:
    """The solution with its singularities: a cheap look at the smallest singular value first, the kinds if it is
    small."""
    m = closer.mechanism
    smallest = closer.smallest(solved.q)
    rows = None
    if output is not None:
        frame = m.frame(output)
        rotation, origin = closer.kin.pose(frame.body)
        rows = closer.kin.jacobian(frame.body, origin + rotation @ frame.placement.translation)
    elif smallest > 1e-3:
        return replace(solved, smallest=smallest)
    kinds = singularity(m, solved.q, rows, SINGULAR)
    if smallest < SINGULAR and not kinds:
        kinds = ("serial",)
    status = Status.BOUNDARY if kinds else Status.SOLVED
    return replace(solved, smallest=smallest, singularities=kinds, status=status)
