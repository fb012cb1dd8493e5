"""Synthesis of motions: four-bars and six-bars whose link carries a body through given positions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import burmester
from mechlab.analytic.path_synthesis.curves import Array, Complex
from mechlab.analytic.path_synthesis.path import leading_row, path_fourbars
from mechlab.analytic.path_synthesis.sixbar_path import path_sixbars
from mechlab.analytic.path_synthesis.task import EXACT, PathTask
from mechlab.errors import MechlabError
from mechlab.mechanism.newton import Status
from mechlab.progress import counted, part
from mechlab.studies.synthesis.built import Built, rounded
from mechlab.studies.synthesis.given import Given
from mechlab.studies.synthesis.linkages import NAMED, POINTS, angles_off, fourbar_parameters, kept, verified_rows
from mechlab.studies.synthesis.result import SynthesisResult, found_rows

SEARCHED = frozenset({"arm", "size", "transmission_angle_min"})
"""Keys of the search: with one of them, five positions are not answered in closed form."""


def motion(given: Given) -> SynthesisResult:
    """Four-bars or six-bars that carry a body through positions: five of a four-bar in closed form (`mechlab.analytic.burmester`), all else
    by least squares (`path_synthesis.path`, `sixbar_path`), where an error of angle counts as a distance at the length `arm`."""
    x = given.numbers("x", "m", 3, POINTS)
    y, angles = given.numbers("y", "m", len(x), len(x)), np.array(given.numbers("angle", "rad", len(x), len(x)))
    places, limit, six = np.array(x) + 1j * np.array(y), given.integer("limit", 3, 1, 50), given.six_bar()
    if len(x) == burmester.POSITIONS and not six and not SEARCHED & given.values.keys():
        return _five(given, places, angles, limit if "limit" in given.values else None)
    extent = given.extent(places)
    if not extent > 0.0:
        raise MechlabError("synthesize motion: the body's origin stays in one place, so a pivot there carries it; give places that differ.")
    task = PathTask(
        places, None, given.within("size", "m", 10.0 * extent, 0.1 * extent, 1e6 * extent),
        given.within("transmission_angle_min", "rad", np.radians(10.0), 0.0, np.radians(80.0)), angles,
        given.within("arm", "m", 0.5 * extent, 1e-3 * extent, 1e3 * extent),
    )  # fmt: skip
    bars = path_fourbars(task, part(given.progress, 0, 30 if six else 90))
    chosen, left_out = kept(path_sixbars(task, bars, progress=part(given.progress, 30, 90)) if six else bars, task)
    solutions = verified_rows(given, counted(chosen, part(given.progress, 90, 100)), task, limit, left_out)
    data: dict[str, Any] = {"count": len(solutions), "solutions": solutions, "left_out": left_out, "positions": len(x), "arm": task.arm}
    if not solutions:
        return SynthesisResult(given.task, Status.OUT_OF_REACH, _out_of_reach(task, six, left_out), data)
    text = f"{NAMED[solutions[0]['entry']]} carries the body through the {len(x)} positions {_how(solutions[0], task)}"
    if six and (four := kept(bars, task)[0]):
        off = angles_off(four[0].distances, task.arm)
        data["best_fourbar"] = {
            "worst": float(np.max(four[0].distances[:, 0])), "worst_angle": float(np.max(off)), "squares": four[0].squares,
        }  # fmt: skip
        text += f", a four-bar {_how(data['best_fourbar'], task)}"
    text += f"; left out: {left_out['branch']} that jump the branch, {left_out['order']} the order"
    names = ("entry", "worst", "worst_angle", "least_transmission_angle", "crank_turns", "body_from_link")
    sizes = ("crank", "coupler", "rocker", "ground", *(("link", "output") if six else ()))
    rows = tuple((*(s[n] for n in names), *(s["parameters"][k] for k in sizes)) for s in solutions)
    return SynthesisResult(given.task, Status.SOLVED, text, data, (*names, *sizes), rows, tuple(s["command"] for s in solutions))


def _how(errors: Mapping[str, Any], task: PathTask) -> str:
    if errors["worst"] < EXACT * task.extent and errors["worst_angle"] * task.arm < EXACT * task.extent:
        return "exactly"
    return f"within {errors['worst']:.4g} m and {np.degrees(errors['worst_angle']):.4g} deg"


def _out_of_reach(task: PathTask, six: bool, left_out: Mapping[str, int]) -> str:
    return (
        f"no {'six-bar' if six else 'four-bar'} carries the body near these {len(task.targets)} positions in their order with a "
        f"transmission angle of {np.degrees(task.least):.3g} deg and bars up to {task.size:.4g} m ({left_out['branch']} would have to be "
        f"taken apart, {left_out['order']} meet the positions in another order). Try a smaller transmission_angle_min, a larger size"
        + (", or fewer positions" if six else ", chain=six-bar, or fewer positions")
    )


def _five(given: Given, places: Complex, angles: Array, limit: int | None) -> SynthesisResult:
    """Four-bars whose coupler passes through five positions exactly."""
    found = burmester.leading_fourbars(places, angles)[:limit]
    solutions, commands = [], []
    for f in found:
        row: dict[str, Any] = {}
        for name, dyad in (("driver", f.first), ("follower", f.second)):
            row |= {f"{name}_pivot_x": dyad.pivot.real, f"{name}_pivot_y": dyad.pivot.imag, name: dyad.length}
            row |= {f"{name}_pin_x": dyad.point.real, f"{name}_pin_y": dyad.point.imag}
        solutions.append(row | {"coupler": f.coupler, "one_mode": f.same_mode})
        if f.same_mode:
            commands.append(_leading(f, places, angles).command)
    data = {"count": len(found), "solutions": solutions, "commands": commands}
    if not found:
        text = (
            "no four-bar leads a body through these five positions: they have no real circle points; change one of them a little, "
            "or take chain=six-bar"
        )
        return SynthesisResult(given.task, Status.OUT_OF_REACH, text, data)
    whole = sum(f.same_mode for f in found)
    many = "1 four-bar passes" if len(found) == 1 else f"{len(found)} four-bars pass"
    text = f"{many} through the five positions, {whole} of them without being taken apart; pins in the axes of the body"
    return replace(found_rows(given.task, text, data, solutions), commands=tuple(commands))


def _leading(f: burmester.LeadingFourbar, places: Complex, angles: Array) -> Built:
    """A four-bar of two dyads as the entry path_fourbar."""
    row, mode, crank = leading_row(f, places, angles)
    return Built("path_fourbar", rounded(fourbar_parameters(row, mode, 0, crank)), crank)
