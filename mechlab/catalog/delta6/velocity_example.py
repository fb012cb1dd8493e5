"""The source's velocity example, always with the source's parameters: checks A1 and A2, claims C25 to C30."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.bibliography import THESIS
from mechlab.catalog.delta6.masses import vec
from mechlab.catalog.delta6.parameters import (
    ANGLES,
    CENTRE,
    HEAD_POSE,
    ROTARY,
    SLIDERS,
    SOURCE,
    Delta6Parameters,
    legs,
)  # fmt: skip
from mechlab.catalog.delta6.poses import at_home, gear_matrix, response
from mechlab.engines.protocol import StatePlant
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit.claims import (
    Evidence,
    Ledger,
    cannot,
    evidence,
    fails,
    holds,
    misprint,
    only_if,
    same_digits,
    shows,
    true,
)  # fmt: skip
from mechlab.mechanism.geometry import Array

LEDGER = Ledger(THESIS)
Names = tuple[str, ...]


def a1(p: Delta6Parameters) -> CheckResult:
    """The source's velocity example of the translation."""
    geom, home, ones = SOURCE.geometry, np.zeros(3), np.ones(3)
    rows, _ = closed.implicit_matrices(geom, home)
    rates = closed.slider_rates(geom, home, ones), closed.platform_velocity(geom, home, ones)
    values = {"analytic": np.concatenate([*rates, rows.ravel()])}
    values |= at_home(SOURCE, "minimal", _translation)
    expected = [1.27086, 1.79385, -0.06471, 0.0, 0.0, 1.0]
    expected += [-0.39159, 0.23374, -0.58277, -0.00663, -0.456, -0.58277, 0.39822, 0.22226, -0.58277]
    # The expected numbers have five decimals: 5e-6 of rounding.
    return CheckResult(values, 1e-5, expected, "slider rates for v_O = (1, 1, 1), v_O for unit slider rates, rows of A")


def _translation(w: StatePlant) -> Array:
    """Slider rates for v_O = (1, 1, 1), v_O for unit slider rates, rows 2 (G, -h): 15 numbers."""
    rotation, origin = w.pose("platform")
    rows = [2.0 * (origin + rotation @ vec(leg.lower) - w.pose(f"rod_{leg.index}")[1]) for leg in legs(SOURCE)]
    back, forth = _unit_rates(w, SLIDERS, HEAD_POSE, CENTRE), _unit_rates(w, CENTRE, (*SLIDERS, *ANGLES), SLIDERS)
    return np.concatenate([back, forth, np.ravel(rows)])


def _unit_rates(w: StatePlant, wanted: Names, given: Names, driving: Names) -> list[float]:
    """Rates of some joints or shafts for unit rates of those in `driving` together, the others of `given` held."""
    rates = response(w, given)[:, [given.index(n) for n in driving]].sum(axis=1)
    return [w.mechanism.row(n) @ rates for n in wanted]


def a2(p: Delta6Parameters) -> CheckResult:
    """The source's velocity example of the rotation."""
    geom, ones = SOURCE.geometry, np.ones(3)
    both = closed.drives_from_angles(geom, ones), closed.angles_from_drives(geom, ones)
    values = {"analytic": np.concatenate(both)} | at_home(SOURCE, "parts", _rotation)
    # -0.5109 has four decimals: 5e-5 of rounding.
    note = "K (1, 1, 1) and K^-1 (1, 1, 1) through nine gear meshes; the source prints the latter as (0, -0.51, 1): alpha and beta swapped"
    return CheckResult(values, 5e-5, [1.4, 2.966, 1.0, -0.5109, 0.0, 1.0], note)


def _rotation(w: StatePlant) -> Array:
    """Drive rates for unit rates of the angles, rates of the angles for unit drive rates: 6 numbers."""
    back, forth = _unit_rates(w, ROTARY, HEAD_POSE, ANGLES), _unit_rates(w, ANGLES, (*CENTRE, *ROTARY), ROTARY)
    return np.array(back + forth)


CHECKS = (
    Check("A1", "velocity example of the translation (source's parameters)", a1,
          "thesis abstract, chapter 4, velocity example of the translation"),
    Check("A2", "velocity example of the rotation, through the gears (source's parameters)", a2,
          "thesis abstract, chapter 4, velocity example of the rotation"),
)  # fmt: skip

PRINTED_A = np.array([[-0.39, 0.233, -0.58], [-6.63e-3, -0.456, -0.58], [0.398, 0.222, -0.58]])
PRINTED_B = 0.58 * np.eye(3)
A_DECIMALS = np.array([[2, 3, 2], [5, 3, 2], [3, 3, 2]])


@LEDGER.claim(
    "C25", "chapter 4, translation example, matrices",
    "The matrices A (printed below) and B = 0.58 I of the translation.", PRINTED_A.tolist(),
    holds(when=true("home_fits")),
    holds("every digit, for rods of 0.37 m with the guides 0.2278 m outside their platform joints and 3.3 mm beside them; these "
          "dimensions are found from the digits, the source prints none", when=true("nearby_fits")),
    cannot("no geometry tried gives these digits"),
)  # fmt: skip
def digits() -> Evidence:
    """Is there a delta of this kind whose A and B round to every printed digit?"""
    shifted = replace(SOURCE, radial_offset=0.22775)
    cases = {
        "rod 0.37 m, offset 0.228 m, O = 0": (SOURCE, np.zeros(3)),
        "offset 0.22775 m, O = (0, -0.14, 0) mm": (shifted, np.array([0.0, -1.4e-4, 0.0])),
    }
    computed: dict[str, Any] = {}
    fits = []
    for name, (p, centre) in cases.items():
        a, b = closed.implicit_matrices(p.geometry, centre)
        fits.append(same_digits(a, PRINTED_A, A_DECIMALS) and same_digits(np.diag(b), [0.58] * 3, 2))
        computed |= {f"analytic: A, {name}": a.round(6).tolist(), f"analytic: every digit, {name}": fits[-1]}
    return evidence(computed, home_fits=fits[0], nearby_fits=fits[1])


def _rounded(w: StatePlant, wanted: Names, driving: Names, decimals: int) -> list[float]:
    """Rates of three joints for unit rates of three others together, the angles held."""
    return [round(float(x), decimals) for x in _unit_rates(w, wanted, (*driving, *ANGLES), driving)]


@LEDGER.claim(
    "C26", "chapter 4, translation example, forward",
    "Unit rates of the sliders give V = (0, 0, 1) m/s.", [0.0, 0.0, 1.0],
    holds(when=shows("all", 2)),
    misprint("{correct}"),
)  # fmt: skip
def translation_forward() -> Evidence:
    """V for unit slider rates."""
    computed = {"printed matrices": np.linalg.solve(PRINTED_A, -PRINTED_B @ np.ones(3)).round(9).tolist()}
    computed |= at_home(SOURCE, "full", lambda w: _rounded(w, CENTRE, SLIDERS, 9))
    return evidence(computed, all=list(computed.values()), correct=computed["numpy"])


@LEDGER.claim(
    "C27", "chapter 4, translation example, inverse",
    "V = (1, 1, 1) m/s needs slider rates of 1.27, 1.79, -0.06 m/s.", [1.27, 1.79, -0.06],
    holds(when=shows("matrices", 2)),
    only_if("A and B are carried with more digits than printed; the printed ones give 1.27, 1.80, -0.07",
            when=shows("geometry", 2)),
    misprint("{correct}"),
)  # fmt: skip
def translation_inverse() -> Evidence:
    """Slider rates for V = (1, 1, 1)."""
    matrices = np.linalg.solve(-PRINTED_B, PRINTED_A @ np.ones(3))
    geometry = {"analytic": closed.slider_rates(SOURCE.geometry, np.zeros(3), np.ones(3)).round(5).tolist()}
    geometry |= at_home(SOURCE, "full", lambda w: _rounded(w, SLIDERS, CENTRE, 5))
    computed = {"printed matrices": matrices.round(5).tolist()} | geometry
    return evidence(computed, matrices=matrices, geometry=list(geometry.values()), correct=matrices.round(2).tolist())


PRINTED_ROTATION = np.array([[0.783, -0.783, 1.4], [0.783, 0.783, 1.4], [0.0, 0.0, 1.0]])
PRINTED_DRIVE_RATES = [1.4, 2.966, 1.0]


@LEDGER.claim(
    "C28", "chapter 4, rotation example, forward",
    "Unit rates of the rotary drives give (a', b', g') = (0, -0.51, 1) rad/s.", [0.0, -0.51, 1.0],
    holds(when=shows("rates", 2)),
    misprint("alpha' = -0.51, beta' = 0, gamma' = 1: alpha and beta are swapped", when=shows("swapped", 2)),
    fails("the printed matrix gives other rates"),
)  # fmt: skip
def rotation_forward() -> Evidence:
    """(alpha', beta', gamma') for unit rates of the rotary drives, signs aside."""
    found = {"printed matrix, B = -I": np.linalg.solve(PRINTED_ROTATION, np.ones(3))}
    found |= at_home(SOURCE, "parts", lambda w: np.linalg.solve(gear_matrix(w), np.ones(3)))
    rates = np.array(list(found.values()))
    return evidence({k: v.round(6).tolist() for k, v in found.items()}, rates=rates, swapped=rates[:, [1, 0, 2]])


@LEDGER.claim(
    "C29", "chapter 4, rotation example, equation", "A V = -(B) w with B = I.", "B = I",
    holds(when=shows("printed matrix, B = I as printed", 3, of=PRINTED_DRIVE_RATES)),
    misprint("B = -I; with B = I all printed results would have the other sign",
             when=shows("printed matrix, B = -I", 3, of=PRINTED_DRIVE_RATES)),
    fails("neither sign of B gives the printed results"),
)  # fmt: skip
def rotation_sign() -> Evidence:
    """A V = -(B) w as printed, with B = I."""
    found = {
        "B = I as printed": np.linalg.solve(-np.eye(3), PRINTED_ROTATION @ np.ones(3)),
        "B = -I": PRINTED_ROTATION @ np.ones(3),
    }
    return evidence({f"printed matrix, {k}": v.round(6).tolist() for k, v in found.items()})


@LEDGER.claim(
    "C30", "chapter 4, rotation example, inverse",
    "Unit rates of the angles need drive rates of 1.4, 2.966, 1 rad/s.", PRINTED_DRIVE_RATES,
    holds(when=shows("rates", 3)),
    misprint("{correct}"),
)  # fmt: skip
def rotation_inverse() -> Evidence:
    """Rates of the rotary drives for unit rates of the angles."""
    found = {"analytic": closed.drives_from_angles(SOURCE.geometry, np.ones(3))}
    found |= at_home(SOURCE, "parts", lambda w: gear_matrix(w) @ np.ones(3))
    computed = {k: v.round(9).tolist() for k, v in found.items()}
    return evidence(computed, rates=list(found.values()), correct=computed["analytic"])
