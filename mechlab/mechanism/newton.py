"""Newton and path continuation for r(q) = 0, and the status of a solution.

Written over callables, so that the numpy tree, Pinocchio and MuJoCo are closed by the same code:
`evaluate(q) -> (residual (m,), jacobian (m, nv))` and `step(q, dv) -> q`.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.least_norm import least_norm

Evaluate = Callable[[Array], tuple[Array, Array]]
Step = Callable[[Array, Array], Array]


class Status(Enum):
    """Status of a solution, as a sentence for the user."""

    SOLVED = "solved"
    BOUNDARY = "on the boundary: the position is singular"
    OUT_OF_REACH = "out of reach"
    NO_ASSEMBLY = "no assembly exists here"
    CHANGE_POINT = "change point: two assembly modes meet here"
    MODES_MERGE = "modes merge here"
    NO_REGIME = "no such regime"
    WRONG_MODE = "wrong mode avoided: the solver met another assembly mode and did not take it"
    REDUNDANT = "redundant: some constraint rows repeat others"
    NOT_CONVERGED = "did not converge"
    DISAGREE = "the witnesses differ by more than the tolerance of the question; do not trust the answer"

    @property
    def exit_code(self) -> int:
        """Exit code of the command line: 0 answered, 3 do not trust it, 4 no solution exists."""
        if self in (Status.SOLVED, Status.BOUNDARY, Status.REDUNDANT):
            return 0
        if self in (
            Status.NOT_CONVERGED, Status.WRONG_MODE, Status.CHANGE_POINT, Status.MODES_MERGE, Status.DISAGREE,
        ):  # fmt: skip
            return 3
        return 4


@dataclass(frozen=True)
class Assembly:
    """Result of closing a mechanism: coordinates, largest residual, iterations, status."""

    q: Array
    residual: float
    iterations: int
    status: Status

    @property
    def closed(self) -> bool:
        """True when the residual is at rounding level."""
        return self.status is Status.SOLVED


def lightest_correction(mass: Array, rows: Array, residual: Array) -> Array:
    """(nv,) displacement dq with rows dq = -residual that is the smallest in the sense of the kinetic energy, dq^T M dq.

        dq = -M^-1 J^T (J M^-1 J^T)^+ r,    mass M (nv, nv), rows J (m, nv), residual r (m,); J may have redundant rows.
    Where M is singular by itself, the smallest displacement in the sense of least squares.
    """
    try:
        moved = np.linalg.solve(mass, rows.T)
    except np.linalg.LinAlgError:
        return np.asarray(-np.linalg.lstsq(rows, residual, rcond=1e-11)[0])
    return np.asarray(-moved @ np.linalg.lstsq(rows @ moved, residual, rcond=1e-11)[0])


def newton(
    evaluate: Evaluate, step: Step, q: Array, *, tolerance: float = 1e-13, iterations: int = 60, largest: float = 0.5
) -> Assembly:
    """Damped Newton for r(q) = 0 with the minimum-norm step of a possibly redundant Jacobian.

    The step is limited to `largest` [rad or m per rate] and halved until the residual falls. Converged means below
    `tolerance`, or at rounding level: below 1e-11 and no longer falling. Never returns a NaN.
    """
    residual, jacobian = evaluate(q)
    size = float(np.max(np.abs(residual), initial=0.0))
    for k in range(iterations):
        if size < tolerance:
            return Assembly(q, size, k, Status.SOLVED)
        dv = -least_norm(jacobian, residual)
        biggest = float(np.max(np.abs(dv), initial=0.0))
        if not np.isfinite(biggest):
            break
        scale = min(1.0, largest / biggest) if biggest > 0 else 1.0
        for _ in range(12):
            trial = step(q, scale * dv)
            new_residual, new_jacobian = evaluate(trial)
            new_size = float(np.max(np.abs(new_residual), initial=0.0))
            if new_size < size:
                break
            scale *= 0.5
        else:
            return Assembly(q, size, k, Status.SOLVED if size < 1e-11 else Status.NOT_CONVERGED)
        if size < 1e-11 and new_size > 0.5 * size:
            return Assembly(trial, new_size, k + 1, Status.SOLVED)
        q, residual, jacobian, size = trial, new_residual, new_jacobian, new_size
    return Assembly(q, size, iterations, Status.SOLVED if size < 1e-11 else Status.NOT_CONVERGED)


def follow(
    evaluate: Callable[[Array, float], tuple[Array, Array]],
    step: Step,
    q: Array,
    *,
    steps: int = 10,
    smallest: float = 1e-4,
) -> Assembly:
    """Path continuation: closes r(q, s) = 0 from s = 0, where q is closed, to s = 1.

    A step of s is accepted when Newton converges and moves each coordinate by less than 0.5; otherwise it is halved.
    Below `smallest` the path has ended: status CHANGE_POINT when the Jacobian is singular there, else NOT_CONVERGED.
    """
    s, ds = 0.0, 1.0 / steps
    total = 0
    found = newton(lambda x: evaluate(x, 0.0), step, q)
    if not found.closed:
        return found
    while s < 1.0:
        target = min(1.0, s + ds)
        trial = newton(lambda x, target=target: evaluate(x, target), step, found.q, iterations=12)  # type: ignore[misc]
        total += trial.iterations
        moved = float(np.max(np.abs(trial.q - found.q), initial=0.0))
        if trial.closed and moved < 0.5:
            found, s = trial, target
            ds *= 1.5 if trial.iterations <= 4 else 1.0
            continue
        ds *= 0.5
        if ds < smallest:
            values = np.linalg.svd(evaluate(found.q, s)[1], compute_uv=False)
            status = Status.CHANGE_POINT if values[-1] < 1e-3 * values[0] else Status.NOT_CONVERGED
            return Assembly(found.q, found.residual, total, status)
    return Assembly(found.q, found.residual, total, Status.SOLVED)
