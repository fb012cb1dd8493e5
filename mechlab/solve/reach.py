"""Why a search for a position failed: out of reach, no assembly, or merely not converged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mechlab.mechanism.assembly import Assembly, Status
from mechlab.mechanism.geometry import Array
from mechlab.solve.closer import Closer

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
