"""Synthesis of dwells: six-bars whose output rests while a coupler point goes along an arc, or straight along a slot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechlab.analytic.path_synthesis.dwell import DwellSixbar, dwell_sixbars
from mechlab.analytic.path_synthesis.slotted_dwell import SlottedDwell, slotted_dwells
from mechlab.mechanism.newton import Status
from mechlab.progress import counted, part
from mechlab.studies.synthesis.built import Built, led, rounded
from mechlab.studies.synthesis.given import Given
from mechlab.studies.synthesis.result import SynthesisResult
from mechlab.studies.synthesis.segments import CLOSE, PLACES, least_of, nothing, shown

START = 1.0
"""Crank angle of the reference pose of the entry stephenson [rad]."""


def dwell(given: Given) -> SynthesisResult:
    """Six-bars whose output rests for a crank angle, by an arc or by a straight part of a coupler curve: see
    `mechlab.analytic.path_synthesis.dwell` and `slotted_dwell`."""
    given.number("angle", "rad")
    angle = given.within("angle", "rad", np.pi, np.radians(10.0), np.radians(270.0))
    swing = given.within("swing", "rad", np.radians(30.0), np.radians(1.0), np.radians(150.0))
    crank, size = given.within("crank", "m", 0.05, 1e-6, 1e3), given.within("size", "", 8.0, 2.0, 50.0)
    least, limit, progress = least_of(given), given.integer("limit", 3, 1, 6), part(given.progress, 0, 85)
    straight = given.one_of("segment", ("arc", "straight")) == "straight"
    if not straight and "clearance" in given.values:
        raise given.refuse("clearance", "segment=straight beside it: an arc needs no slot")
    clearance = given.within("clearance", "", 1.0, 0.05, 10.0)
    found: Sequence[DwellSixbar | SlottedDwell] = (
        slotted_dwells(angle, swing, size, least, clearance, progress) if straight else dwell_sixbars(angle, swing, size, least, progress)
    )
    solutions, tried = [], 0
    for f in counted(found[:limit], part(given.progress, 85, 100)):
        tried += 1
        built, inside = _slotted(f, angle, crank) if isinstance(f, SlottedDwell) else _stephenson(f, angle, crank)
        output = "lever_angle" if straight else "output_angle"
        seen = led(given.find, built, (output,))
        if seen is None:
            continue
        witness, at = seen
        turned = at[output][inside] if witness else np.array([0.0, f.deviation])
        rest = float(np.ptp(np.angle(np.exp(1j * (turned - turned[0])))))
        if abs(rest - f.deviation) > CLOSE + 0.02 * f.deviation:
            continue
        facts: dict[str, Any] = {
            "deviation": f.deviation, "measured_deviation": rest, "measured_by": witness or "closed form", "swing": f.swing,
            "dwell_from": f.first, "dwell_to": f.first + angle, "least_transmission_angle": f.least_transmission_angle,
        }  # fmt: skip
        if isinstance(f, SlottedDwell):
            facts |= {"slot_from": f.slot[0] * crank, "slot_to": f.slot[1] * crank}
        solutions.append(Built(built.entry, built.parameters, built.angles, facts).to_dict())
    data = {"count": len(solutions), "solutions": solutions, "left_out": {"engine": tried - len(solutions)}, "angle": angle}
    if not solutions:
        return SynthesisResult(given.task, Status.OUT_OF_REACH, nothing("six-bar rests and swings so far", least, size, "cranks"), data)
    best = solutions[0]
    text = (
        f"the {'slotted lever' if straight else 'output'} of a {'six-bar' if straight else 'Stephenson six-bar'} rests within a strip of "
        f"{np.degrees(best['deviation']):.4g} deg while the crank turns through {np.degrees(angle):g} deg, and swings by "
        f"{np.degrees(best['swing']):.4g} deg"
    )
    names = ("deviation", "swing", "dwell_from", "dwell_to", "least_transmission_angle")
    bars = ("pivot_x", "pivot_y", "lever") if straight else ("link", "output")
    return shown(given, text, data, ("coupler", "rocker", "ground", *bars), names)


def _fourbar(f: DwellSixbar | SlottedDwell, crank: float) -> dict[str, float | int]:
    """Its crank-rocker, coupler point and output pivot in their size."""
    return {
        "crank": crank, "coupler": f.coupler * crank, "rocker": f.rocker * crank, "ground": f.ground * crank, "mode": 1,
        "point": abs(f.point) * crank, "point_angle": float(np.angle(f.point)),
        "pivot_x": f.pivot.real * crank, "pivot_y": f.pivot.imag * crank,
    }  # fmt: skip


def _stephenson(f: DwellSixbar, angle: float, crank: float) -> tuple[Built, Any]:
    """The six-bar in its size, led through a turn from its reference pose; which of the crank angles lie in the dwell."""
    rest = START + (f.first + np.linspace(0.0, 1.0, PLACES) * angle - START) % (2.0 * np.pi)
    around = np.concatenate([[START], np.sort(rest), [START + 2.0 * np.pi]])
    inside = np.concatenate([[False], np.ones(PLACES, dtype=bool), [False]])
    sizes = _fourbar(f, crank) | {"link": f.link * crank, "output": f.output * crank, "mode_output": f.side}
    return Built("stephenson", rounded(sizes), around), inside


def _slotted(f: SlottedDwell, angle: float, crank: float) -> tuple[Built, Any]:
    """The six-bar in its size, led through a turn from the beginning of its dwell; which of the crank angles lie in the dwell."""
    around = f.first + np.append(np.linspace(0.0, 1.0, PLACES) * angle, 2.0 * np.pi)
    sizes = _fourbar(f, crank) | {"lever": f.slot[1] * crank, "first": f.first}
    return Built("slotted_dwell", rounded(sizes), around), slice(PLACES)
