"""The ledger of the paper on the inertial-impulse transmission: equations, motor, regime, harmonics, figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.analytic.impulse import Impulse, coefficients, periodic_orbit, section_points, shape, unidirectional
from mechlab.catalog.impulse_transmission.build import build
from mechlab.catalog.impulse_transmission.checks import SPEED, i1
from mechlab.catalog.impulse_transmission.claims_figures import FIGURE_CLAIMS
from mechlab.catalog.impulse_transmission.claims_harmonics import HARMONIC_CLAIMS
from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.catalog.impulse_transmission.questions import TURNS, closed_cycle
from mechlab.catalog.impulse_transmission.runs import of_scene
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.mechanism.structure import structure

PAPER = "paper on the dynamics of an inertial-impulse transmission (source 002)"


def coefficients_right() -> ClaimResult:
    """A1 ... A6 in the equations, against a tree of rigid bodies."""
    worst = i1(Parameters()).difference
    computed = {"pinocchio: largest relative difference of accelerations, 100 states": worst}
    return ClaimResult(
        computed, Verdict.HOLDS if worst < 1e-12 else Verdict.FAILS, "" if worst < 1e-12 else "they differ"
    )


def coefficient_derivatives() -> ClaimResult:
    """A4, A5, A6 as halves of derivatives of A1, A2, A3, by central differences."""
    p, psi, h = Impulse(), np.linspace(0.0, 6.0, 25), 1e-5
    up, down = coefficients(p, psi + p.q * h), coefficients(p, psi - p.q * h)
    slopes = [(x - y) / (2.0 * h) for x, y in zip(up[:3], down[:3], strict=True)]
    _, _, _, A4, A5, A6 = coefficients(p, psi)
    gaps = {
        "2 A4 - dA1/dalpha": float(np.abs(2.0 * A4 - slopes[0]).max()),
        "2 A5 - dA3/dbeta": float(np.abs(2.0 * A5 + slopes[2]).max()),
        "2 A6 + d(A1 + 2 A2 + A3)/dalpha": float(np.abs(2.0 * A6 + slopes[0] + 2.0 * slopes[1] + slopes[2]).max()),
    }
    # Central differences with a step of 1e-5: error about 1e-10 of coefficients of order 1.
    good = max(gaps.values()) < 1e-8
    return ClaimResult(dict(gaps), Verdict.HOLDS if good else Verdict.FAILS, "" if good else "a derivative differs")


def two_coordinates() -> ClaimResult:
    """Degrees of freedom of the full mechanism."""
    p = Parameters()
    freedoms = structure(build(p, "full")).freedoms
    computed = {"mechanism: degrees of freedom of full": freedoms}
    if freedoms == 3:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed, Verdict.MISPRINT, f"i = 1, 2: there are {freedoms} generalised coordinates, alpha and beta"
    )


def motor_constants() -> ClaimResult:
    """Torque that the printed constants give at the no-load speed, for the printed sets."""
    computed: dict[str, object] = {}
    good = []
    for name in ("fig2", "fig4", "fig5", "fig5-swapped"):
        i = of_scene(name).impulse
        left = i.Mn - (i.no_load_speed - i.nominal_speed) / i.speed_per_torque
        computed[f"{name}: torque at no_load_speed [N m]"] = float(left)
        computed[f"{name}: slip_per_torque that fits"] = float(i.consistent_slip)
        good.append(abs(left) < 0.1 * i.Mn)
    fits = [n for n, x in zip(("fig2", "fig4", "fig5", "fig5-swapped"), good, strict=True) if x]
    if len(fits) == 4:
        return ClaimResult(computed, Verdict.HOLDS)
    because = (
        f"the set is {', '.join(fits)}; with the others the torque does not vanish at the no-load speed" if fits else ""
    )
    return ClaimResult(computed, Verdict.HOLDS_ONLY_IF if fits else Verdict.FAILS, because or "no set is consistent")


def motor_unit() -> ClaimResult:
    """Unit of nu from Md' = (Mn - Md - (alpha' - wn) / (nu wxx)) / tau."""
    computed = {"dimension: nu wxx in rad/s per N m, hence nu in": "1/(N m) = s^2/(kg m^2)"}
    return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, "the damaged unit is read as s^2/(kg m^2), which is 1/(N m)")


def quadratic() -> ClaimResult:
    """The printed balances with t_i = pi / (q (w - w_i)), evaluated in the simulated regime."""
    p = Impulse(M0=2.0, M1=10.0)
    found, run = unidirectional(p, SPEED), closed_cycle(p, SPEED)
    assert run is not None
    R1, R2, t1, t2 = p.M0 + p.M1, p.M0 - p.M1, float(found.forward_time), float(found.return_time)
    # Eliminating Md from momentum and work, with w - w_i = pi/(q t_i), leaves (R1 + R2) pi / q = 0.
    momentum = (R1 * t1 + R2 * t2) / (t1 + t2)
    speeds = [SPEED - np.pi / (p.q * t) for t in (t1, t2)]
    work = (R1 * speeds[0] * t1 + R2 * speeds[1] * t2) / (SPEED * (t1 + t2))
    forward = float(found.psi_b - found.psi_a)
    computed = {
        "analytic: M1 + M2, which the printed system forces to 0 [N m]": R1 + R2,
        "analytic: mean torque by momentum [N m]": momentum,
        "analytic: mean torque by work with t_i = pi/(q (w - w_i)) [N m]": work,
        "hybrid: mean torque [N m]": run.torque_integral / run.time,
        "analytic: half-phase forward, printed pi [rad]": forward,
        "hybrid: mean speed [rad/s]": run.angle / run.time,
        "analytic: mean speed by exact half-phases [rad/s]": float(found.mean_speed),
        "hybrid: forward time of a cycle [s]": run.forward_time / TURNS,
    }
    if abs(momentum - work) < 1e-9 * abs(momentum):
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed, Verdict.FAILS,
        "the system is degenerate: momentum, work and t_i = pi/(q (w - w_i)) together say M1 + M2 = 0. The half-phases are "
        "pi (1 -+ M0/M1), equal to pi for M0 = 0 only; the mean speed follows from the first integral",
    )  # fmt: skip


def limit_cycles() -> ClaimResult:
    """Floquet multipliers of the orbit of figure 7, and the spread of the section of a motion beside it."""
    i = of_scene("fig7").impulse
    orbit = periodic_orbit(i, SPEED)
    sizes = np.abs(orbit.multipliers)
    points = section_points(i, SPEED, orbit.start + [0.005, 0.0], 150)
    # Distances from the orbit in the units of the small ellipse, first and last third of the run.
    away = np.hypot(points[:, 0], (points[:, 1] - orbit.start[1]) / (i.q * SPEED))
    computed = {
        "shooting: |Floquet multipliers|": [float(x) for x in sizes],
        "DOP853: largest distance from the orbit, turns 1 to 50 [rad]": float(away[1:51].max()),
        "DOP853: the same, turns 101 to 150 [rad]": float(away[101:].max()),
    }
    if np.all(sizes < 1.0 - 1e-3):
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed, Verdict.FAILS,
        "no damping, both multipliers lie on the unit circle: neighbouring motions stay beside the orbit and do not come to it. "
        "A limit cycle needs M1 > 0 or the damping of the motor",
    )  # fmt: skip


def load_direction() -> ClaimResult:
    """Sign of the mean speed over M0/M1."""
    p = replace(Impulse(), M1=750.0)
    ratio = np.linspace(0.0, 0.1, 1001)
    mean = unidirectional(p, SPEED, 750.0 * ratio, 750.0).mean_speed
    change = float(ratio[np.argmax(mean < 0)])
    computed = {
        "analytic: M0/M1 at which the mean speed vanishes": change,
        "analytic: a6 - a5 [kg m2]": shape(p).a6 - shape(p).a5,
    }
    verdict = Verdict.HOLDS_ONLY_IF if np.any(mean < 0) else Verdict.HOLDS
    return ClaimResult(
        computed,
        verdict,
        f"M0/M1 is below {change:.3g} (set (4), M1 = 750, 150 rad/s); above it the load drives the shaft back",
    )


CLAIMS = (
    Claim("M1", "equations (2)", "The coefficients A1 to A6 and the signs of the equations.", "A1 ... A6", coefficients_right, PAPER),
    Claim("M2", "equations (2)", "A4, A5, A6 follow from A1, A2, A3.", "A4, A5, A6", coefficient_derivatives, PAPER),
    Claim("M3", "Lagrange's equations", "Lagrange's equations are written for i = 1, 2, 3.", "i = 1, 2, 3", two_coordinates, PAPER),
    Claim("M4", "motor", "nu = 0.0024 with the printed torques and speeds.", 0.0024, motor_constants, PAPER),
    Claim("M5", "motor", "The unit of nu.", "c*/kg m2", motor_unit, PAPER),
    Claim("M6", "mean speed", "Momentum, work and t_i = pi/(q (w - w_i)) give a quadratic equation of the mean speed.",
          "A wm^2 + B wm + C = 0", quadratic, PAPER),
    Claim("M7", "figures 7 and 8", "The loops are limit cycles.", "limit cycles", limit_cycles, PAPER),
    Claim("M8", "mean speed", "The output shaft goes on in one direction under load.", "forward", load_direction, PAPER),
    *HARMONIC_CLAIMS,
    *FIGURE_CLAIMS,
)  # fmt: skip
