"""Claims of the thesis abstract on the control of the head."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.claims_freedoms import THESIS
from mechlab.catalog.delta6.probes import SOURCE
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.mechanism.geometry import Array

GAINS = {"velocity 240, position 480": (240.0, 480.0), "velocity 480, position 240": (480.0, 240.0)}


def _source_errors() -> tuple[Array, Array]:
    start = closed.source_targets(0.0)
    return closed.SOURCE_START_ANGLES - start.angles, closed.SOURCE_START_RATES - start.rates


def targets() -> ClaimResult:
    """Printed rates and accelerations against differences of the printed angles."""
    t, h = np.linspace(0.0, 3.0, 31), 1e-4
    angles = np.array([[0.1 * np.sin(10 * x), 0.1 * np.cos(10 * x), 0.2 * np.sin(5 * x)] for x in (t - h, t, t + h)])
    rates = np.array([np.cos(10 * t), -np.sin(10 * t), np.cos(5 * t)])
    accel = np.array([-10 * np.sin(10 * t), -10 * np.cos(10 * t), -5 * np.sin(5 * t)])
    first = float(np.abs((angles[2] - angles[0]) / (2 * h) - rates).max())
    second = float(np.abs((angles[2] - 2 * angles[1] + angles[0]) / h**2 - accel).max())
    computed = {"differences: rates off by [rad/s]": first, "differences: accelerations off by [rad/s2]": second}
    if first < 1e-5 and second < 1e-4:  # h^2 of the next derivative: 1e-6 and 1e-5
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(computed, Verdict.MISPRINT, "the derivatives of the printed angles")


def gain_order() -> ClaimResult:
    """'Velocity and position: 240, 480': what each order would do."""
    e, de = _source_errors()
    computed: dict[str, object] = {}
    stable = []
    t = np.linspace(0.0, 15.0, 15_001)
    for name, (kv, kp) in GAINS.items():
        roots = np.sort(np.roots([1.0, kv, kp]).real)
        gamma = np.abs(closed.error_response(t, e[2], de[2], kv, kp).error)
        late = np.flatnonzero(gamma > 1e-3)
        computed |= {
            f"analytic: roots, {name} [1/s]": roots.tolist(),
            f"analytic: damping ratio, {name}": kv / (2.0 * math.sqrt(kp)),
            f"analytic: error of gamma at 2 s, {name} [rad]": float(np.interp(2.0, t, gamma)),
            f"analytic: below 1 mrad after, {name} [s]": float(t[late[-1]]) if len(late) else 0.0,
        }
        stable.append(bool(roots.max() < 0.0))
    if stable == [True, False]:
        return ClaimResult(computed, Verdict.HOLDS, "the other order is unstable")
    if stable == [False, True]:
        return ClaimResult(computed, Verdict.MISPRINT, "velocity 480, position 240: the printed order is unstable")
    return ClaimResult(
        computed,
        Verdict.CANNOT,
        "both orders converge and are strongly overdamped; the printed one is far quicker and more plausible, "
        "but only the curves of figure 9 could decide",
    )


def minimal_error() -> ClaimResult:
    """Integral of the squared error of gamma with the printed gains, and with critical damping for the same position gain."""
    e, de = _source_errors()
    t = np.linspace(0.0, 10.0, 100_001)

    def cost(kv: float, kp: float) -> float:
        return float(np.trapezoid(closed.error_response(t, e[2], de[2], kv, kp).error ** 2, t))

    printed = {name: cost(kv, kp) for name, (kv, kp) in GAINS.items()}
    critical = {name: cost(2.0 * np.sqrt(kp), kp) for name, (_, kp) in GAINS.items()}
    computed = {f"analytic: integral of e^2, {k} [rad2 s]": v for k, v in printed.items()}
    computed |= {f"analytic: integral of e^2, critical damping instead of {k} [rad2 s]": v for k, v in critical.items()}
    if min(printed.values()) <= min(critical.values()):
        return ClaimResult(computed, Verdict.HOLDS)
    ratio = min(printed.values()) / min(critical.values())
    return ClaimResult(
        computed,
        Verdict.FAILS,
        f"critical damping with a gain of 480 makes the squared error {ratio:.2g} times smaller; "
        "no sense of 'minimises' is stated in which these gains are best",
    )


def _deviation(scale: float, weight: float) -> float:
    """Largest difference between the controlled head and the ideal error law over 3 s [rad]. The controller's model is the
    head's, its torques scaled; `weight` [N m]: gravity torque on the head that the controller does not know."""
    from scipy.integrate import solve_ivp

    head = closed.HeadInertias()
    e, de = _source_errors()
    kv, kp = GAINS["velocity 240, position 480"]
    start = np.concatenate([closed.SOURCE_START_ANGLES, closed.SOURCE_START_RATES])

    def rhs(t: float, x: Array) -> Array:
        wanted = closed.command(closed.source_targets(t), x[:3], x[3:], kv, kp)
        m, h = closed.mass_matrix(SOURCE.geometry, head, x[1]), closed.bias(head, x[1], x[3:])
        load = np.array([0.0, weight * np.cos(x[1]), 0.0])
        return np.concatenate([x[3:], np.linalg.solve(m, scale * (m @ wanted + h) - h + load)])

    t = np.linspace(0.0, 3.0, 61)
    found = solve_ivp(rhs, (0.0, 3.0), start, "LSODA", t, rtol=1e-8, atol=1e-10)
    ideal = closed.source_targets(t).angles + closed.error_response(t[:, None], e, de, kv, kp).error
    return float(np.abs(found.y[:3].T - ideal).max()) if found.success else float("inf")


def accuracy() -> ClaimResult:
    """The control law on a head that is as modelled, 20 % off, or heavy."""
    weight = SOURCE.output_mass * 9.81 * SOURCE.head_offset
    cases = {
        "exact model": _deviation(1.0, 0.0),
        "model 0.8 of the truth": _deviation(0.8, 0.0),
        "weight of the output link not modelled": _deviation(1.0, weight),
    }
    computed = {f"integration: angles off the error law, {k} [rad]": v for k, v in cases.items()}
    good, *others = cases.values()
    if good > 1e-6:
        return ClaimResult(computed, Verdict.FAILS, "even with the exact model the error does not follow its law")
    if max(others) < 1e-4:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed,
        Verdict.HOLDS_ONLY_IF,
        "the controller's model is exact and has gravity in it: the weight of the output link, left out, "
        f"turns the head by up to {max(others):.2g} rad",
    )


CLAIMS = (
    Claim("C34", "chapter 4, wanted motion",
          "Rates cos 10t, -sin 10t, cos 5t and accelerations -10 sin 10t, -10 cos 10t, -5 sin 5t belong to the angles.",
          [".1 sin 10t", ".1 cos 10t", ".2 sin 5t"], targets, THESIS),
    Claim("C35", "chapter 4, gains",
          "The gains on velocity and position are 240 and 480, in this order.", [240, 480], gain_order, THESIS),
    Claim("C36", "chapter 4, control law",
          "The control law minimises the error in position, velocity and acceleration.", "minimal", minimal_error, THESIS),
    Claim("C37", "conclusion 5",
          "The control law reaches the dynamic accuracy that is asked for.", "accurate", accuracy, THESIS),
)  # fmt: skip
