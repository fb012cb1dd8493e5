"""Claims on the small-parameter solution: the printed amplitudes against shooting."""

from __future__ import annotations

import numpy as np

from mechlab.analytic.impulse import Impulse, harmonic_amplitudes, harmonic_motion, periodic_orbit
from mechlab.analytic.impulse.regime import motion
from mechlab.catalog.impulse_transmission.checks import SPEED
from mechlab.experiment.entry import Claim, ClaimResult, Verdict

PAPER = "paper on the dynamics of an inertial-impulse transmission (source 002)"
FIGURE_7 = Impulse(M0=0.0, M1=0.0, c=500.0)


def first_and_third() -> ClaimResult:
    """D1 and D3 of the third order, against the Fourier coefficients of the orbit."""
    orbit = periodic_orbit(FIGURE_7, SPEED)
    printed, consistent = (harmonic_amplitudes(FIGURE_7, SPEED, k) for k in ("printed", "consistent"))
    lowest = harmonic_amplitudes(FIGURE_7, SPEED, "consistent")
    t = np.linspace(0.0, orbit.period, 401)
    truth = motion(FIGURE_7, SPEED, orbit.start, orbit.period, t)[0]
    computed: dict[str, object] = {
        "shooting: amplitudes [rad]": [float(x) for x in orbit.sines],
        "printed: amplitudes [rad]": [float(x) for x in printed],
        "all terms of third order: amplitudes [rad]": [float(x) for x in consistent],
    }
    errors = {}
    for kind in ("printed", "consistent"):
        near = harmonic_motion(FIGURE_7, SPEED, t, kind)[0]
        errors[kind] = float(np.abs(near - truth).max() / np.abs(truth).max())
        computed[f"{kind}: largest relative error of beta"] = errors[kind]
    if abs(printed[2] / orbit.sines[2] - 1.0) < 0.1 and errors["printed"] < 2.0 * errors["consistent"]:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed, Verdict.FAILS,
        f"D1 and D3 keep the term A5 beta'^2 only: D3 is {lowest[2] / printed[2]:.3g} times too small and D1 has the wrong sign; "
        f"with all terms of third order the error falls from {100 * errors['printed']:.3g} % to {100 * errors['consistent']:.2g} %",
    )  # fmt: skip


def second() -> ClaimResult:
    """D2 of the second order."""
    orbit = periodic_orbit(FIGURE_7, SPEED)
    D2 = harmonic_amplitudes(FIGURE_7, SPEED, "printed")[1]
    computed = {"printed formula: D2 [rad]": float(D2), "shooting: second harmonic [rad]": float(orbit.sines[1])}
    # The next terms are of the fourth order in D0 q = 0.15.
    good = abs(D2 / orbit.sines[1] - 1.0) < 0.03
    return ClaimResult(computed, Verdict.HOLDS if good else Verdict.FAILS, "" if good else "the amplitude differs")


HARMONIC_CLAIMS = (
    Claim("M9", "small parameter, D1 and D3", "Amplitudes of the first and third harmonic.", "D1, D3", first_and_third, PAPER),
    Claim("M10", "small parameter, D0 and D2", "Amplitudes of the zeroth approximation and the second harmonic.", "D0, D2", second, PAPER),
)  # fmt: skip
