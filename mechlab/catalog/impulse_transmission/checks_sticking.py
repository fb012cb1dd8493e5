"""Checks of sticking: effort, state at the end, and what smoothed friction comes to."""

from __future__ import annotations

import numpy as np

from mechlab.analytic.impulse import slope
from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.catalog.impulse_transmission.runs import end, hybrid_run, of_scene
from mechlab.catalog.impulse_transmission.scenes import simulate
from mechlab.errors import NoSolution
from mechlab.experiment.entry import Check, CheckResult
from mechlab.integrate import integrate_adaptive
from mechlab.mechanism.geometry import Array


def i7_effort(p: Parameters) -> CheckResult:
    """Evaluations of the sticking scene, against the bound; naive sign functions need more than 4e5 and do not end."""
    recording = hybrid_run(of_scene("sticking"), "sticking", 0.3)
    return CheckResult({"hybrid": float(recording.cost.evaluations)}, 5e4, 5e4, "evaluations, must lie below 1e5")


def i7_sticking(p: Parameters) -> CheckResult:
    """Sticking by Pinocchio's tree and by the closed form: state at the end."""
    q = of_scene("sticking")
    truth = simulate(q, np.array([0.0, 0.3]))[0][-1][[1, 3, 2, 4]]
    return CheckResult(
        {"analytic": truth, "hybrid": end(hybrid_run(q, "sticking", 0.3))}, 1e-6, None, "beta, beta', alpha', Md"
    )


def smoothed_end(p: Parameters, duration: float, width: float) -> Array:
    """(5,) state at the end with M1 tanh(beta' / width) instead of dry friction, by DOP853 1e-9."""

    def f(t: float, y: Array) -> Array:
        return slope(p.impulse, y, width)

    done = integrate_adaptive(f, 0.0, p.start, duration, rtol=1e-9, atol=1e-11, most_evaluations=2_000_000)
    if not done.complete:
        raise NoSolution(f"tanh friction of width {width:g}: {done.outcome.value}.")
    return np.asarray(done.y[-1])


def i7_tanh(p: Parameters) -> CheckResult:
    """Friction smoothed by tanh comes to the sticking solution linearly in its width."""
    q = of_scene("sticking")
    truth = simulate(q, np.array([0.0, 0.3]))[0][-1]
    error = [abs(smoothed_end(q, 0.3, w)[3] - truth[3]) for w in (0.2, 0.1)]
    order = float(np.log2(error[0] / error[1]))
    return CheckResult(
        {"tanh": order}, 0.25, 1.0, f"order in the width; errors of beta' {error[0]:.2g}, {error[1]:.2g} rad/s"
    )


STICKING_CHECKS = (
    Check("I7a", "evaluations of the sticking scene", i7_effort, "specification: below 1e5"),
    Check("I7b", "sticking by the tree and by the closed form", i7_sticking, "each other"),
    Check("I7c", "smoothed friction comes to the sticking solution linearly", i7_tanh, "event simulation", slow=True),
)
