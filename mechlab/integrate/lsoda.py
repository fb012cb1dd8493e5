"""Integration with step-size control by LSODA (Petzold 1983), which turns implicit by itself where the problem is stiff.

scipy's compiled loop calls the right-hand side; the steps themselves cost no Python.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechlab.integrate.work import LSODA_CALL, count_work

Array = NDArray[np.float64]
MOST_STEPS = 500_000
"""Between two times asked for."""


@dataclass(frozen=True)
class Table:
    """States y (n, m) at the first n of the times asked for; steps, evaluations, and why it ended early ("": it did not)."""

    y: Array
    steps: int
    evaluations: int
    reason: str


def integrate_lsoda(
    f: Callable[[float, Array], Array],
    y0: Array,
    times: Array,
    tolerance: float,
    jacobian: Callable[[float, Array], Array] | None = None,
) -> Table:
    """dy/dt = f(t, y) from y0 (m,) at times[0] to all of `times` (n,). `tolerance` is relative; absolute, a tenth of it.
    jacobian: df/dy (m, m), where it costs less than m calls of f, by which it is found else."""
    import warnings

    from scipy.integrate import ODEintWarning, odeint

    def counted(t: float, y: Array) -> Array:
        count_work(LSODA_CALL)
        return f(t, y)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ODEintWarning)
        y, told = odeint(
            counted,
            y0,
            times,
            tfirst=True,
            rtol=tolerance,
            atol=0.1 * tolerance,
            full_output=1,
            mxstep=MOST_STEPS,
            Dfun=jacobian,
        )
    fine = np.all(np.isfinite(y), axis=1)
    count = len(times)
    reason = ""
    if told["message"] != "Integration successful.":
        count = 1 + int(np.argmin(np.diff(told["tcur"]) > 0.0)) if len(times) > 2 else 1
        reason = f"LSODA stopped before t = {times[min(count, len(times) - 1)]:.4g} s: {told['message']}"
    elif not fine.all():
        reason = "the state is not finite"
    if not fine.all():
        count = min(count, int(np.argmin(fine)))
    return Table(np.asarray(y[:count]), int(told["nst"][-1]), int(told["nfe"][-1]), reason)
