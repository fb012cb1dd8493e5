"""Claims of the thesis abstract on velocities: the two numerical examples of chapter 4, digit by digit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.claims_drives import gear_matrix
from mechlab.catalog.delta6.claims_freedoms import THESIS
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, SLIDERS, SOURCE
from mechlab.catalog.delta6.responses import response
from mechlab.catalog.delta6.witnesses import witnesses
from mechlab.experiment.entry import Claim, ClaimResult, Verdict

PRINTED_A = np.array([[-0.39, 0.233, -0.58], [-6.63e-3, -0.456, -0.58], [0.398, 0.222, -0.58]])
PRINTED_B = 0.58 * np.eye(3)
A_DECIMALS = np.array([[2, 3, 2], [5, 3, 2], [3, 3, 2]])
PRINTED_ROTATION = np.array([[0.783, -0.783, 1.4], [0.783, 0.783, 1.4], [0.0, 0.0, 1.0]])


def shows(value: ArrayLike, printed: ArrayLike, decimals: ArrayLike) -> bool:
    """True when every value, rounded to the decimals that are printed, is the printed number."""
    half = 0.5 * 10.0 ** -np.broadcast_to(np.asarray(decimals, dtype=float), np.shape(printed))
    return bool(np.all(np.abs(np.asarray(value) - np.asarray(printed)) <= half * (1.0 + 1e-9)))


# -- translation ---------------------------------------------------------------------------------------------------------


def digits() -> ClaimResult:
    """Is there a delta of this kind whose A and B round to every printed digit?"""
    shifted = replace(SOURCE, radial_offset=0.22775)
    cases = {
        "rod 0.37 m, offset 0.228 m, O = 0": (SOURCE, np.zeros(3)),
        "offset 0.22775 m, O = (0, -0.14, 0) mm": (shifted, np.array([0.0, -1.4e-4, 0.0])),
    }
    computed: dict[str, object] = {}
    fits = []
    for name, (p, centre) in cases.items():
        a, b = closed.implicit_matrices(p.geometry, centre)
        fit = shows(a, PRINTED_A, A_DECIMALS) and shows(np.diag(b), [0.58] * 3, 2)
        computed |= {f"analytic: A, {name}": a.round(6).tolist(), f"analytic: every digit, {name}": fit}
        fits.append(fit)
    if fits[0]:
        return ClaimResult(computed, Verdict.HOLDS)
    if any(fits):
        return ClaimResult(
            computed,
            Verdict.HOLDS,
            "every digit, for rods of 0.37 m with the guides 0.2278 m outside their platform joints and 3.3 mm beside them",
        )
    return ClaimResult(computed, Verdict.CANNOT, "no geometry tried gives these digits")


def translation_forward() -> ClaimResult:
    """V for unit slider rates."""
    computed = {"printed matrices": np.linalg.solve(PRINTED_A, -PRINTED_B @ np.ones(3)).round(9).tolist()}
    for w in witnesses(build(SOURCE, "full")):
        rates = response(w, (*SLIDERS, *ANGLES))[:, :3].sum(axis=1)
        computed[w.name] = [round(float(w.mechanism.row(n) @ rates), 9) for n in CENTRE]
    if all(shows(v, [0.0, 0.0, 1.0], 2) for v in computed.values()):
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(computed, Verdict.MISPRINT, str(computed["numpy"]))


def translation_inverse() -> ClaimResult:
    """Slider rates for V = (1, 1, 1)."""
    printed = [1.27, 1.79, -0.06]
    from_matrices = np.linalg.solve(-PRINTED_B, PRINTED_A @ np.ones(3))
    computed = {
        "printed matrices": from_matrices.round(5).tolist(),
        "analytic": closed.slider_rates(SOURCE.geometry, np.zeros(3), np.ones(3)).round(5).tolist(),
    }
    for w in witnesses(build(SOURCE, "full")):
        rates = response(w, (*CENTRE, *ANGLES))[:, :3].sum(axis=1)
        computed[w.name] = [round(float(w.mechanism.row(n) @ rates), 5) for n in SLIDERS]
    geometry = all(shows(v, printed, 2) for k, v in computed.items() if k != "printed matrices")
    if shows(from_matrices, printed, 2):
        return ClaimResult(computed, Verdict.HOLDS)
    if geometry:
        return ClaimResult(
            computed,
            Verdict.HOLDS_ONLY_IF,
            "A and B are carried with more digits than printed; the printed ones give 1.27, 1.80, -0.07",
        )
    return ClaimResult(computed, Verdict.MISPRINT, str(from_matrices.round(2).tolist()))


# -- rotation ------------------------------------------------------------------------------------------------------------


def rotation_forward() -> ClaimResult:
    """(alpha', beta', gamma') for unit rates of the rotary drives, signs aside."""
    printed = [0.0, -0.51, 1.0]
    found = {"printed matrix, B = -I": np.linalg.solve(PRINTED_ROTATION, np.ones(3))}
    found |= {w.name: np.linalg.solve(gear_matrix(w), np.ones(3)) for w in witnesses(build(SOURCE, "parts"))}
    computed = {k: v.round(6).tolist() for k, v in found.items()}
    if all(shows(v, printed, 2) for v in found.values()):
        return ClaimResult(computed, Verdict.HOLDS)
    if all(shows(v[[1, 0, 2]], printed, 2) for v in found.values()):
        return ClaimResult(
            computed, Verdict.MISPRINT, "alpha' = -0.51, beta' = 0, gamma' = 1: alpha and beta are swapped"
        )
    return ClaimResult(computed, Verdict.FAILS, "the printed matrix gives other rates")


def rotation_sign() -> ClaimResult:
    """A V = -(B) w as printed, with B = I."""
    printed = [1.4, 2.966, 1.0]
    found = {
        "B = I as printed": np.linalg.solve(-np.eye(3), PRINTED_ROTATION @ np.ones(3)),
        "B = -I": PRINTED_ROTATION @ np.ones(3),
    }
    computed = {f"printed matrix, {k}": v.round(6).tolist() for k, v in found.items()}
    if shows(found["B = I as printed"], printed, 3):
        return ClaimResult(computed, Verdict.HOLDS)
    if shows(found["B = -I"], printed, 3):
        return ClaimResult(
            computed, Verdict.MISPRINT, "B = -I; with B = I all printed results would have the other sign"
        )
    return ClaimResult(computed, Verdict.FAILS, "neither sign of B gives the printed results")


def rotation_inverse() -> ClaimResult:
    """Rates of the rotary drives for unit rates of the angles."""
    found = {"analytic": closed.drives_from_angles(SOURCE.geometry, np.ones(3))}
    found |= {w.name: gear_matrix(w) @ np.ones(3) for w in witnesses(build(SOURCE, "parts"))}
    computed = {k: v.round(9).tolist() for k, v in found.items()}
    if all(shows(v, [1.4, 2.966, 1.0], 3) for v in found.values()):
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(computed, Verdict.MISPRINT, str(computed["analytic"]))


CLAIMS = (
    Claim("C25", "chapter 4, translation example, matrices",
          "The matrices A (printed below) and B = 0.58 I of the translation.", PRINTED_A.tolist(), digits, THESIS),
    Claim("C26", "chapter 4, translation example, forward",
          "Unit rates of the sliders give V = (0, 0, 1) m/s.", [0.0, 0.0, 1.0], translation_forward, THESIS),
    Claim("C27", "chapter 4, translation example, inverse",
          "V = (1, 1, 1) m/s needs slider rates of 1.27, 1.79, -0.06 m/s.", [1.27, 1.79, -0.06], translation_inverse, THESIS),
    Claim("C28", "chapter 4, rotation example, forward",
          "Unit rates of the rotary drives give (a', b', g') = (0, -0.51, 1) rad/s.", [0.0, -0.51, 1.0], rotation_forward, THESIS),
    Claim("C29", "chapter 4, rotation example, equation", "A V = -(B) w with B = I.", "B = I", rotation_sign, THESIS),
    Claim("C30", "chapter 4, rotation example, inverse",
          "Unit rates of the angles need drive rates of 1.4, 2.966, 1 rad/s.", [1.4, 2.966, 1.0], rotation_inverse, THESIS),
)  # fmt: skip
