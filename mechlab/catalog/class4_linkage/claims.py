"""Printed statements of Zinchenko 2009 on the class IV mechanism, tested."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import assur
from mechlab.catalog.bibliography import ZINCHENKO
from mechlab.catalog.class4_linkage.build import build
from mechlab.catalog.class4_linkage.geometry import Class4Parameters, at, solve_all
from mechlab.kit.claims import Evidence, Ledger, above, below, equals, evidence, fails, holds, none, only_if, unreadable
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import structure

LEDGER = Ledger(ZINCHENKO)
PRINTED = Class4Parameters()
TURN = -np.pi + np.radians(5.0) * np.arange(72)


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _at_rest(point: assur.Point) -> assur.Point:
    zero = np.zeros_like(point.p)
    return assur.Point(point.p, zero, zero)


def _dyad_3_5(p: Class4Parameters, c: assur.Point) -> assur.Dyad:
    return assur.rrr(c, assur.fixed(*p.F), p.BC, p.BF, 1)


def _on_grid(phi2: Array) -> Array:
    """The nearest angle that the printed iteration visits: from -phi1 in steps of d phi / 4."""
    step = np.radians(1.25)
    return np.asarray(-TURN - step * np.round((-TURN - phi2) / step))


@LEDGER.claim(
    "Z1", "introduction, fig. 2", "a crank and one structural group of class IV, order 2", "one group",
    holds("with the crank held nothing moves", when=equals("degrees of freedom", 1)),
    fails("with the crank held nothing moves"),
)  # fmt: skip
def one_group() -> Evidence:
    """Degrees of freedom of the crank with the group."""
    found = structure(build(PRINTED, "minimal"))
    return evidence({"degrees of freedom": found.mobility, "void rows": len(found.redundant)})


@LEDGER.claim(
    "Z2", "step 2", "angles 37.3 deg = 0.65 rad, 28.1 deg = 0.49 rad", [0.65, 0.49],
    holds(when=below(1e-3, "largest shift of *")),
    only_if("0.1 deg is enough: use the degrees, not the rounded radians"),
)  # fmt: skip
def rounded_angles() -> Evidence:
    """How far the links shift when the rounded radians are used."""
    rough = replace(PRINTED, CAD=0.65, BFE=0.49)
    exact, near = at(PRINTED, TURN), at(rough, TURN)
    shift = {n: float(np.degrees(np.max(np.abs(near.angles[n].x - exact.angles[n].x)))) for n in ("theta2", "theta5")}
    computed = {f"largest shift of {n} [deg]": v for n, v in shift.items()}
    return evidence(computed | {"37.3 deg [rad]": float(np.radians(37.3)), "28.1 deg [rad]": float(np.radians(28.1))})


@LEDGER.claim(
    "Z3", "step 2", "Y_F = -108, l_EF = 13, as the scan shows it", [-108, 13],
    holds(when=equals("as_printed", 360)),
    unreadable("y_F = -1.08 and l_EF = 1.3: the commas are lost; PAR1 in step 6 has 1.3, and with both all positions close",
               when=equals("restored", 360) & none("as_printed")),
    fails("the mechanism does not close with the commas either"),
)  # fmt: skip
def decimal_points() -> Evidence:
    """Positions that close with each number as printed, and with both decimal points set."""
    counts = {}
    changes: tuple[tuple[str, dict[str, Any]], ...] = (
        ("F = (0, -108)", {"F": (0.0, -108.0)}), ("EF = 13", {"EF": 13.0}), ("F = (0, -1.08), EF = 1.3", {}),
    )  # fmt: skip
    for name, change in changes:
        found = solve_all(replace(PRINTED, **change), np.radians(np.arange(-180.0, 180.0)))
        counts[f"positions of 360 that close, {name}"] = int(np.count_nonzero(found.modes.count))
    return evidence(counts, as_printed=list(counts.values())[:2], restored=list(counts.values())[2])


def literal_rates() -> tuple[Array, Array]:
    """Rates (72,) of links 2 and 5 by the printed algorithm to the letter: C as the pin of a crank about A's position with w = 1,
    phi2 on its grid, dyad 3-5, then dyad 2-3 from A and B (step 9)."""
    mode = at(PRINTED, TURN)
    c = assur.driver(_at_rest(mode.points["A"]), PRINTED.AC, _on_grid(mode.angles["theta2"].x), 1.0)
    dyad = _dyad_3_5(PRINTED, c)
    return assur.rrr(mode.points["A"], dyad.joint, PRINTED.AC, PRINTED.BC, 1).angles[0].v, dyad.angles[1].v


@LEDGER.claim(
    "Z4", "step 4", "C is found by ASSURL1 about A with w = 1, eps = 0", "w2 = 1",
    holds(when=below(1e-3, "rms error of the rate of link *")),
    fails("pass position, velocity and acceleration of A, and find w2 = -(dL/dphi1)/(dL/dphi2) w1 from the closing link; with "
          "w2 = w1 and A at rest every rate and acceleration of links 2, 3 and 5 is wrong"),
)  # fmt: skip
def step_four() -> Evidence:
    """The rates of `literal_rates` against the true ones."""
    mode = at(PRINTED, TURN)
    true2, true5 = mode.angles["theta2"].v, mode.angles["theta5"].v
    literal2, literal5 = literal_rates()
    errors = {"2": literal2 - true2, "5": literal5 - true5}
    computed: dict[str, Any] = {f"rms error of the rate of link {k}": _rms(e) for k, e in errors.items()}
    computed["largest error of the rate of link 2"] = float(np.max(np.abs(errors["2"])))
    return evidence(computed | {"true range of the rate of link 2": [float(true2.min()), float(true2.max())]})


@LEDGER.claim(
    "Z5", "step 4, step 10", "phi2 = phi1 - d phi / 4 and iterations, read as steps of d phi / 4 until DE equals the given length", 1.25,
    holds(when=below(1e-6, "largest misfit of DE [m]")),
    only_if("the step is made smaller in the end, which is not printed: with this step the search stops up to half of it away, and "
            "DE is off by up to {misfit:.2g} m",
            when=above(1e-6, "largest misfit of DE [m]") & below(0.5 * 1.25 + 1e-9, "largest error of phi2 [deg]")
            # Half a step turns AC = 0.985 m by 11 mm, and DE cannot change by more here.
            & below(0.011, "largest misfit of DE [m]")),
    fails("the search ends farther off than half a step"),
)  # fmt: skip
def iterations() -> Evidence:
    """phi2 in steps of d phi / 4 = 1.25 deg until the length DE fits."""
    mode = at(PRINTED, TURN)
    true = mode.angles["theta2"].x
    nearest = _on_grid(true)
    lengths = []
    for phi2, a in zip(nearest, mode.points["A"].p, strict=True):
        a_point = assur.fixed(float(a.real), float(a.imag))
        b = _dyad_3_5(PRINTED, assur.driver(a_point, PRINTED.AC, float(phi2))).joint.p
        f = complex(*PRINTED.F)
        e = f + (b - f) / PRINTED.BF * PRINTED.EF * np.exp(1j * PRINTED.BFE)
        d = a + PRINTED.AD * np.exp(1j * (phi2 + PRINTED.CAD))
        lengths.append(abs(complex(e - d)))
    misfit = float(np.max(np.abs(np.array(lengths) - PRINTED.DE)))
    return evidence({
        "largest error of phi2 [deg]": float(np.degrees(np.max(np.abs(nearest - true)))), "largest misfit of DE [m]": misfit,
    }, misfit=misfit)  # fmt: skip


@LEDGER.claim(
    "Z6", "step 5", "K1 = 1, K2 = 1", [1, 1],
    holds("one mode has K1 = K2 = +1 all the way round; the only other one has both -1",
          when=equals("K1 over the turn") & equals("K2 over the turn")),
    fails("no mode has K1 = K2 = +1 all the way round"),
)  # fmt: skip
def signs_of_modes() -> Evidence:
    """Smallest and largest K1 and K2 over the turn, in the mode that the parameters choose."""
    found = solve_all(PRINTED, TURN)
    k = found.chosen[:, None]
    k1, k2 = (np.take_along_axis(x, k, axis=1)[:, 0] for x in (found.k1, found.k2))
    return evidence({
        "K1 over the turn": [float(k1.min()), float(k1.max())], "K2 over the turn": [float(k2.min()), float(k2.max())],
        "modes at every position": [int(found.modes.count.min()), int(found.modes.count.max())],
    })  # fmt: skip


@LEDGER.claim(
    "Z7", "step 9", "C and D follow from A and B with K2", "K2 = 1",
    holds(when=below(1e-9, "*mode K = -1 [m]")),
    fails("C of step 9 is not C of step 4", when=above(1e-9, "*mode K = +1 [m]")),
    only_if("K2 is the side on which C already lies; with the other sign the mirror image of C and D is returned, unnoticed"),
)  # fmt: skip
def step_nine() -> Evidence:
    """C found once more from A and B with K2 = +1, in both modes."""
    gaps = {}
    for sign in (1, -1):
        mode = at(replace(PRINTED, mode=sign), TURN)
        again = assur.rrr(mode.points["A"], mode.points["B"], PRINTED.AC, PRINTED.BC, 1).joint.p
        name = f"C of step 9 with K2 = +1 against C of step 4, mode K = {sign:+d} [m]"
        gaps[name] = float(np.max(np.abs(again - mode.points["C"].p)))
    return evidence(gaps)


@LEDGER.claim(
    "Z8", "steps 8 to 10", "the flag G says whether a group is assembled, and DE is compared with its given length", "G, DE",
    fails("G is no sign of a gap of the dyads", when=none("closed")),
    only_if("a tolerance of DE is set, which is not printed: with l_BC = 0.27 m at phi1 = -102 deg no position exists and G is true; "
            "the misfit of DE, {gap:.4f} m, does show it, beside {step:.4f} m that the step of phi2 leaves where there is one",
            when=none("modes") & above(2.0, "gap_over_step")),
    fails("the misfit of DE cannot be told from what the step of phi2 leaves"),
)  # fmt: skip
def no_root() -> Evidence:
    """Where no position exists: does the printed G say so, and does the printed comparison of DE?"""
    short = replace(PRINTED, BC=0.27)
    phi1 = np.radians(-102.0)
    a = assur.driver(assur.fixed(), short.OA, phi1)
    phi2 = np.linspace(-np.pi, np.pi, 20001)
    dyad = _dyad_3_5(short, assur.driver(a, short.AC, phi2))
    f = complex(*short.F)
    e = f + (dyad.joint.p - f) / short.BF * short.EF * np.exp(1j * short.BFE)
    length = np.abs(e - a.p - short.AD * np.exp(1j * (phi2 + short.CAD)))
    closed, gap = int(np.count_nonzero(dyad.assembles)), float(np.nanmin(np.abs(length - short.DE)))
    step = float(iterations().computed["largest misfit of DE [m]"])
    return evidence({
        "angles phi2 at which G says that the dyad closes": closed, "smallest misfit of DE at them [m]": gap,
        "modes": int(solve_all(short, np.array([phi1])).modes.count[0]), "largest misfit that the step of phi2 leaves [m]": step,
    }, closed=closed, gap=gap, step=step, gap_over_step=gap / step)  # fmt: skip


CLAIMS = LEDGER.claims
