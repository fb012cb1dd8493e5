"""Printed claims of the paper on the inertial-impulse transmission: equations, motor, regime, harmonics."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic.impulse import (
    Impulse,
    coefficients,
    harmonic_amplitudes,
    motor_orbit,
    periodic_orbit,
    section_points,
    shape,
    unidirectional,
)
from mechlab.catalog.bibliography import ALYUKOV
from mechlab.catalog.impulse_transmission.build import Parameters, build
from mechlab.catalog.impulse_transmission.checks import equations, error_of_harmonics
from mechlab.catalog.impulse_transmission.questions import closing
from mechlab.catalog.impulse_transmission.scenes import FIGURE_7, SPEED, of_scene, simulate
from mechlab.kit.claims import (
    Evidence,
    Ledger,
    above,
    below,
    equals,
    evidence,
    factor,
    fails,
    holds,
    misprint,
    only_if,
    unreadable,
)
from mechlab.mechanism.structure import structure

LEDGER = Ledger(ALYUKOV)
LEAST = 1e-7
"""Distance of a multiplier from the unit circle that shooting can tell: its derivative is right to 1e-9."""


@LEDGER.claim(
    "M1", "equations (2)", "The coefficients A1 to A6 and the signs of the equations.", "A1 ... A6",
    holds(when=below(1e-12, "pinocchio: largest relative difference*")), fails("they differ"),
)  # fmt: skip
def coefficients_right() -> Evidence:
    """A1 ... A6 in the equations, against a tree of rigid bodies."""
    worst = equations(Parameters()).difference
    return evidence({"pinocchio: largest relative difference of accelerations, 100 states": worst})


@LEDGER.claim(
    "M2", "equations (2)", "A4, A5, A6 follow from A1, A2, A3.", "A4, A5, A6",
    # Central differences with a step of 1e-5: error about 1e-10 of coefficients of order 1.
    holds(when=below(1e-8, "2 A*")), fails("a derivative differs"),
)  # fmt: skip
def coefficient_derivatives() -> Evidence:
    """A4, A5, A6 as halves of derivatives of A1, A2, A3, by central differences."""
    p, psi, h = Impulse(), np.linspace(0.0, 6.0, 25), 1e-5
    up, down = coefficients(p, psi + p.q * h), coefficients(p, psi - p.q * h)
    dA1, dA2, dA3 = ((x - y) / (2.0 * h) for x, y in zip(up[:3], down[:3], strict=True))
    _, _, _, A4, A5, A6 = coefficients(p, psi)
    gaps = {
        "2 A4 - dA1/dalpha": 2.0 * A4 - dA1,
        "2 A5 - dA3/dbeta": 2.0 * A5 + dA3,
        "2 A6 + d(A1 + 2 A2 + A3)/dalpha": 2.0 * A6 + dA1 + 2.0 * dA2 + dA3,
    }
    return evidence({what: float(np.abs(gap).max()) for what, gap in gaps.items()})


@LEDGER.claim(
    "M3", "Lagrange's equations", "Lagrange's equations are written for i = 1, 2, 3.", "i = 1, 2, 3",
    holds(when=equals("mechanism: degrees of freedom of full", 3)),
    misprint("i = 1, 2: there are {freedoms} generalized coordinates, alpha and beta"),
)  # fmt: skip
def two_coordinates() -> Evidence:
    """Degrees of freedom of the full mechanism."""
    freedoms = structure(build(Parameters(), "full")).freedoms
    return evidence({"mechanism: degrees of freedom of full": freedoms}, freedoms=freedoms)


@LEDGER.claim(
    "M4", "motor", "nu = 0.0024 with the printed torques and speeds.", 0.0024,
    holds(when=equals("count", 4)),
    only_if("the set is {sets}; with the others the torque does not vanish at the no-load speed", when=above(0, "count")),
    fails("no set is consistent"),
)  # fmt: skip
def motor_constants() -> Evidence:
    """Torque that the printed constants give at the no-load speed, for the printed sets."""
    computed, sets = dict[str, Any](), list[str]()
    for name in ("fig2", "fig4", "fig5", "fig5-swapped"):
        i = of_scene(name).impulse
        left = i.Mn - (i.no_load_speed - i.nominal_speed) / i.speed_per_torque
        computed[f"{name}: torque at no_load_speed [N m]"] = float(left)
        computed[f"{name}: slip_per_torque that fits"] = float(i.consistent_slip)
        sets += [name] * bool(abs(left) < 0.1 * i.Mn)
    return evidence(computed, sets=", ".join(sets), count=len(sets))


@LEDGER.claim(
    "M5", "figure 2, list of parameters", "The unit of nu, which the scan shows as c*/(kg m2).", "s^x/(kg m2)",
    unreadable("s^2/(kg m^2), which is 1/(N m); the list of figure 4 shows the same", when=equals("seconds", 2) & equals("rest", [-1, -2])),
    fails("no power of a second makes a unit of nu of it"),
)  # fmt: skip
def motor_unit() -> Evidence:
    """Unit of nu from Md' = (Mn - Md - (alpha' - wn) / (nu wxx)) / tau: that of a speed over a torque and a speed."""
    torque, speed = np.array([1, 2, -2]), np.array([0, 0, -1])  # powers of kg, m, s
    kg, m, s = (speed - torque - speed).tolist()
    return evidence({"dimension: nu in kg^i m^j s^k, i, j, k": [kg, m, s]}, seconds=s, rest=[kg, m])


@LEDGER.claim(
    "M6", "mean speed", "Momentum, work and t_i = pi/(q (w - w_i)) give a quadratic equation of the mean speed.", "A wm^2 + B wm + C = 0",
    holds(when=factor("analytic: mean torque by work*", 1.0, 1e-9, of="analytic: mean torque by momentum [N m]")),
    fails("the system is degenerate: momentum, work and t_i = pi/(q (w - w_i)) together say M1 + M2 = 0. The half-phases are "
          "pi (1 -+ M0/M1), equal to pi for M0 = 0 only; the mean speed follows from the first integral"),
)  # fmt: skip
def quadratic() -> Evidence:
    """The printed balances with t_i = pi / (q (w - w_i)), evaluated in the simulated regime."""
    p = Impulse(M0=2.0, M1=10.0)
    found, run = unidirectional(p, SPEED), closing(p, SPEED, plain=3)
    assert run is not None
    R1, R2, t1, t2 = p.M0 + p.M1, p.M0 - p.M1, float(found.forward_time), float(found.return_time)
    # Eliminating Md from momentum and work, with w - w_i = pi/(q t_i), leaves (R1 + R2) pi / q = 0.
    momentum = (R1 * t1 + R2 * t2) / (t1 + t2)
    speeds = [SPEED - np.pi / (p.q * t) for t in (t1, t2)]
    work = (R1 * speeds[0] * t1 + R2 * speeds[1] * t2) / (SPEED * (t1 + t2))
    return evidence({
        "analytic: M1 + M2, which the printed system forces to 0 [N m]": R1 + R2,
        "analytic: mean torque by momentum [N m]": momentum,
        "analytic: mean torque by work with t_i = pi/(q (w - w_i)) [N m]": work,
        "hybrid: mean torque [N m]": run.mean_motor_torque,
        "analytic: half-phase forward, printed pi [rad]": float(found.psi_b - found.psi_a),
        "hybrid: mean speed [rad/s]": run.mean_speed,
        "analytic: mean speed by exact half-phases [rad/s]": float(found.mean_speed),
        "hybrid: forward time of a cycle [s]": run.forward_time,
    })  # fmt: skip


@LEDGER.claim(
    "M7", "text to figure 7", "The loops of figure 7 are limit cycles.", "limit cycles",
    holds(when=below(1.0 - 1e-3, "shooting, constant speed: |Floquet multipliers|")),
    only_if("the motor turns the input shaft: its damping brings neighbouring motions nearer, by {approach:.2g} of their distance in a "
            "cycle, so that it halves in {half:.2g} min; the few turns of a figure show nothing of it. At constant input speed, as formula "
            "(7) has it, both multipliers lie on the unit circle: neighbours stay beside the orbit and do not come to it",
            when=below(1.0 - LEAST, "shooting, with the motor: |Floquet multipliers|")),
    fails("no damping, both multipliers lie on the unit circle, and with the motor neighbouring motions do not come nearer either"),
)  # fmt: skip
def limit_cycles() -> Evidence:
    """Floquet multipliers of the orbit of figure 7 at constant speed and with the motor, and the spread of the section points of a
    neighbouring motion."""
    i = of_scene("fig7").impulse
    orbit = periodic_orbit(i, SPEED)
    points = section_points(i, SPEED, orbit.start + [0.005, 0.0], 60)
    # Distances from the orbit in the units of the small ellipse, first and last third of the run.
    away = np.hypot(points[:, 0], (points[:, 1] - orbit.start[1]) / (i.q * SPEED))
    cycle = motor_orbit(i, np.array([0.0, SPEED, orbit.start[1], 0.0]))
    return evidence({
        "shooting, constant speed: |Floquet multipliers|": np.abs(orbit.multipliers).tolist(),
        "shooting, with the motor: |Floquet multipliers|": np.abs(cycle.multipliers).tolist(),
        "shooting, with the motor: mean input speed [rad/s]": 2.0 * np.pi / (i.q * cycle.period),
        "DOP853: largest distance from the orbit, turns 1 to 20 [rad]": float(away[1:21].max()),
        "DOP853: the same, turns 41 to 60 [rad]": float(away[41:].max()),
    }, approach=cycle.approach, half=np.log(2.0) / max(cycle.approach, 1e-300) * cycle.period / 60.0)  # fmt: skip


@LEDGER.claim(
    "M8", "text to figure 5", "One-way rotation of the output shaft with high-frequency oscillation is possible.", "one way",
    only_if("M0/M1 is below {change:.3g} (set (4) of figure 5 with M1 = 750, 150 rad/s); above it the load drives the shaft back",
            when=below(0.0, "slowest")),
    holds("M0/M1 is below {change:.3g} (set (4) of figure 5 with M1 = 750, 150 rad/s); above it the load drives the shaft back"),
)  # fmt: skip
def load_direction() -> Evidence:
    """Sign of the mean speed over M0/M1."""
    p = replace(Impulse(), M1=750.0)
    ratio = np.linspace(0.0, 0.1, 1001)
    mean = unidirectional(p, SPEED, 750.0 * ratio, 750.0).mean_speed
    change = float(ratio[np.argmax(mean < 0)])
    computed = {
        "analytic: M0/M1 at which the mean speed vanishes": change,
        "analytic: a6 - a5 [kg m2]": shape(p).a6 - shape(p).a5,
    }
    return evidence(computed, change=change, slowest=float(np.min(mean)))


@LEDGER.claim(
    "M9", "small parameter, D1 and D3", "Amplitudes of the first and third harmonic.", "D1, D3",
    holds(when=below(0.1, "error_of_D3") & below(2.0, "printed_over_all_terms")),
    fails("D1 and D3 keep the term A5 beta'^2 only: D3 is {too_small:.3g} times too small and D1 has the wrong sign; "
          "with all terms of third order the error falls from {error:.3g} % to {least_error:.2g} %"),
)  # fmt: skip
def first_and_third() -> Evidence:
    """D1 and D3 of the third order, against the Fourier coefficients of the orbit."""
    orbit = periodic_orbit(FIGURE_7, SPEED)
    printed, consistent = (harmonic_amplitudes(FIGURE_7, SPEED, k) for k in ("printed", "consistent"))
    computed: dict[str, Any] = {
        "shooting: amplitudes [rad]": [float(x) for x in orbit.sines],
        "printed: amplitudes [rad]": [float(x) for x in printed],
        "all terms of third order: amplitudes [rad]": [float(x) for x in consistent],
    }
    error, least = (error_of_harmonics(kind) for kind in ("printed", "consistent"))
    computed |= {"printed: largest relative error of beta": error, "consistent: largest relative error of beta": least}
    return evidence(
        computed, error_of_D3=abs(printed[2] / orbit.sines[2] - 1.0), too_small=consistent[2] / printed[2],
        printed_over_all_terms=error / least, error=100 * error, least_error=100 * least,
    )  # fmt: skip


@LEDGER.claim(
    "M10", "small parameter, D0 and D2", "Amplitudes of the zeroth approximation and the second harmonic.", "D0, D2",
    # The next terms are of the fourth order in D0 q = 0.15.
    holds(when=factor("printed formula: D2 [rad]", 1.0, 0.03, of="shooting: second harmonic [rad]")), fails("the amplitude differs"),
)  # fmt: skip
def second() -> Evidence:
    """D2 of the second order."""
    orbit = periodic_orbit(FIGURE_7, SPEED)
    D2 = harmonic_amplitudes(FIGURE_7, SPEED, "printed")[1]
    return evidence({"printed formula: D2 [rad]": float(D2), "shooting: second harmonic [rad]": float(orbit.sines[1])})


@LEDGER.claim(
    "M20", "figure 4, initial state", "The input starts at alpha = 1127 rad, as the scan shows it.", 1127,
    holds(when=below(0.35, "printed")),
    unreadable("1.127 rad: the comma is lost, which the other numbers of the list have; from there beta reaches {read:.2f} rad within "
               "0.3 s, near the printed axis of 0.3 rad, from 1127 rad {printed:.2f} rad", when=below(0.35, "read")),
    fails("neither start stays near the printed axis"),
)  # fmt: skip
def start_of_figure_4() -> Evidence:
    """Largest |beta| of figure 4 in 0.3 s from 1127 rad and from 1.127 rad."""
    t, reach = np.linspace(0.0, 0.3, 601), {}
    for start in (1127.0, 1.127):
        y = simulate(replace(of_scene("fig4"), alpha_0=start), t, 1e-8)[0]
        reach[start] = float(np.abs(y[:, 1]).max())
    computed = {f"analytic: largest |beta| in 0.3 s from {k:g} rad [rad]": v for k, v in reach.items()}
    return evidence(computed, printed=reach[1127.0], read=reach[1.127])
