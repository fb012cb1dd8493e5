"""Figure 1 of the source, the mechanism, moved through the 72 positions at which it computes; what its steps 4, 5, 8 and 10 give
there, beside the truth. The source prints no results, only dimensions, steps and coefficients."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import assur
from mechlab.catalog.bibliography import ZINCHENKO
from mechlab.catalog.class4_linkage.claims import PRINTED, TURN, literal_rates, no_root, signs_of_modes
from mechlab.catalog.class4_linkage.geometry import THETAS, Class4Parameters, Mode, arcs, at, family, solve_all
from mechlab.experiment.figure import Curve, Drawing, Mark, Note, Panel, Reading, SourceFigure
from mechlab.mechanism.geometry import Array

CRANK = "phi1 [deg]"
DENSE = np.radians(np.linspace(-180.0, 180.0, 721))
SHOWN = 18
"""Every so many of the 72 positions is drawn as a linkage."""
MODES = {1: "K1 = K2 = +1, as printed", -1: "K1 = K2 = -1, the other mode"}


def _path(z: Any) -> tuple[Array, Array]:
    return np.real(z), np.imag(z)


def _mode(sign: int) -> Class4Parameters:
    return replace(PRINTED, mode=sign)


def _linkage(p: Class4Parameters, mode: Mode, k: int) -> Array:
    """The bars at position k as one line through all pins: O A C D A, D E, E F B E, B C."""
    pins = {"O": 0j, "F": complex(p.F[0], p.F[1])} | {n: complex(x.p[k]) for n, x in mode.points.items()}
    return np.array([pins[n] for n in "OACDADEFBEBC"])


def figure_1() -> Drawing:
    """Both modes: paths of the pins over the turn, and the bars at every 18th of the 72 positions."""
    panels, readings = [], []
    for sign, text in MODES.items():
        p = _mode(sign)
        dense, coarse = at(p, DENSE), at(p, TURN)
        bars = np.stack([_linkage(p, coarse, k) for k in range(0, len(TURN), SHOWN)])
        curves = [Curve(*_path(bars), "bars, every 18th position", "thin", 4)]
        curves += [Curve(*_path(dense.points[n].p), f"path of {n}", "thick", k) for k, n in enumerate("ACDBE")]
        marks = (Mark("O", 0.0, 0.0), Mark("F (0, -1.08)", PRINTED.F[0], PRINTED.F[1]))
        panels.append(Panel(text, "x [m]", "y [m]", tuple(curves), marks, equal=True))
        spans = [np.abs(coarse.points[a].p - coarse.points[b].p) for a, b in ("BC", "DE")]
        gap = max(float(np.abs(x - length).max()) for x, length in zip(spans, (p.BC, p.DE), strict=True))
        means = [float(x.mean()) for x in spans]
        readings.append(Reading(f"links 3 and 4 between the pins at the 72 positions, {text}", [0.3, 0.554], means, "m"))
        readings.append(Reading(f"largest misfit of them, {text}", 0, gap, "m"))
    return Drawing(tuple(panels), tuple(readings))


def steps_2_and_5() -> Drawing:
    """Angles of all links over the turn, in both modes."""
    panels, readings = [], []
    for name in THETAS:
        curves = []
        for k, (sign, text) in enumerate(MODES.items()):
            dense, coarse = at(_mode(sign), DENSE), at(_mode(sign), TURN)
            offset = 2.0 * np.pi * np.round((np.mean(np.unwrap(dense.angles[name].x)) - np.pi) / (2.0 * np.pi))
            whole = np.degrees(np.unwrap(dense.angles[name].x) - offset)
            curves.append(Curve(np.degrees(DENSE), whole, text, "solid", k))
            curves.append(Curve(np.degrees(TURN), np.interp(TURN, DENSE, whole), "", "dots", k))
            ends = np.degrees(np.unwrap(coarse.angles[name].x) - offset)
            readings.append(Reading(f"range of {name}, {text}", "-", [float(ends.min()), float(ends.max())], "deg"))
        panels.append(Panel(name, CRANK, f"{name} [deg]", tuple(curves)))
    found = solve_all(PRINTED, DENSE)
    count = [int(found.modes.count.min()), int(found.modes.count.max())]
    signs = signs_of_modes().computed
    readings.append(Reading("K1, least and most over the turn, in the mode of the steps", 1, signs["K1 over the turn"]))
    readings.append(Reading("K2 likewise", 1, signs["K2 over the turn"]))
    readings.append(Reading("modes at each half degree of the crank, least and most", "-", count))
    return Drawing(tuple(panels), tuple(readings), "Dots: the 72 positions. The group has no other mode at any half degree of the turn.")


def step_4() -> Drawing:
    """Rates of links 2 and 5 by the printed step 4 to the letter, and the true ones."""
    dense, mode, literal = at(PRINTED, DENSE), at(PRINTED, TURN), literal_rates()
    panels, readings = [], []
    for k, name in enumerate(("theta2", "theta5")):
        true = mode.angles[name].v
        curves = (
            Curve(np.degrees(DENSE), dense.angles[name].v, "true", "thick", 0),
            Curve(np.degrees(TURN), literal[k], "step 4 to the letter", "crosses", 1),
        )
        marks = (Mark("step 4: w2 = 1", y=1.0),) if name == "theta2" else ()
        panels.append(Panel(f"rate of link {name[-1]} at w1 = 1 rad/s", CRANK, f"{name}' [rad/s]", curves, marks))
        given, ranges = ([float(x.min()), float(x.max())] for x in (literal[k], true))
        readings.append(Reading(f"{name}': printed in step 4; the true range", 1.0 if name == "theta2" else "-", ranges, "rad/s"))
        rms = float(np.sqrt(np.mean((literal[k] - true) ** 2)))
        readings.append(Reading(f"{name}' that step 4 leads to; its rms error", "-", [*given, rms], "rad/s"))
    return Drawing(tuple(panels), tuple(readings), "Crosses: the printed algorithm, with C as the pin of a crank about A at rest.")


LENGTHS = (0.3, 0.2818, 0.28, 0.27)
"""Link 3 as printed, the shortest that closes all round, and two that do not [m]."""


def step_10() -> Drawing:
    """det J over the turn for shorter links 3: where two modes merge no position exists beyond, and step 10 does not say so."""
    curves, readings = [], []
    for k, length in enumerate(LENGTHS):
        p = replace(PRINTED, BC=length)
        found = solve_all(p, DENSE)
        slot = np.maximum(found.chosen, 0)[:, None]
        det = np.take_along_axis(found.modes.det, slot, axis=1)[:, 0]
        label, style = (f"BC = {length:g} m, as printed", "thick") if k == 0 else (f"BC = {length:g} m", "solid")
        gaps = [[float(np.degrees(low)), float(np.degrees(high))] for low, high in arcs(p)]
        edges = [edge for gap in gaps for edge in gap]
        angle, det = np.append(np.degrees(DENSE), edges), np.append(det, np.zeros(len(edges)))
        order = np.argsort(angle, kind="stable")
        curves.append(Curve(angle[order], det[order], label, style, k))
        readings.append(Reading(f"crank angles without a position, BC = {length:g} m", "-", gaps or "none", "deg" if gaps else ""))
    gap = no_root().computed["smallest misfit of DE at them [m]"]
    readings.append(Reading("length DE, and by how much it is missed at least with BC = 0.27 m at -102 deg", PRINTED.DE, gap, "m"))
    fold = assur.folds(family(replace(PRINTED, BC=0.27)))[0]
    where = float(np.degrees(fold.crank))
    panel = Panel("det J of the chosen mode", CRANK, "det J [m4]", tuple(curves),
                  notes=(Note("two modes merge", -45.0, 0.012, (where, 0.0)),))  # fmt: skip
    return Drawing((panel,), tuple(readings))


FIGURES = (
    SourceFigure("figure 1", "The mechanism through its 72 positions, in both modes.", ZINCHENKO, figure_1, claims=("Z1", "Z3", "Z6")),
    SourceFigure("steps 2 and 5", "Angles of the links over a turn of the crank, in both modes.", ZINCHENKO, steps_2_and_5,
                 claims=("Z2", "Z6", "Z7")),
    SourceFigure("step 4", "Rates by the printed step 4, and the true ones.", ZINCHENKO, step_4, claims=("Z4",)),
    SourceFigure("step 10", "Shorter links 3: limit positions that the printed comparison of DE does not name.", ZINCHENKO, step_10,
                 claims=("Z5", "Z8")),
)  # fmt: skip
