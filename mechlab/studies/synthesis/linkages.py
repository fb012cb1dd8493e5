"""Synthesis of paths: four-bars, geared five-bars and six-bars through given points; what motions share with them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic.path_synthesis.curves import COUPLER, LINK, Array
from mechlab.analytic.path_synthesis.guided_body import GuidedBody
from mechlab.analytic.path_synthesis.path import path_fivebars, path_fourbars
from mechlab.analytic.path_synthesis.sixbar import ARM, PIVOT, ROD, TIP, Sixbar, both_modes
from mechlab.analytic.path_synthesis.sixbar_path import path_sixbars
from mechlab.analytic.path_synthesis.task import EXACT, PathLinkage, PathTask
from mechlab.mechanism.newton import Status
from mechlab.progress import counted, part
from mechlab.studies.synthesis.built import Built, led, rounded
from mechlab.studies.synthesis.given import Given
from mechlab.studies.synthesis.result import SynthesisResult

NAMED = {"path_fourbar": "a four-bar", "path_fivebar": "a geared five-bar", "path_stephenson": "a Stephenson six-bar",
         "path_watt": "a Watt six-bar"}  # fmt: skip
POINTS = 200
"""Most points of a path."""
CLOSE = 1e-7
"""Largest distance between what the engine reaches and the closed form, relative to the extent of the points: the solver's tolerance."""


def path(given: Given) -> SynthesisResult:
    """Four-bars, and geared five-bars where those do not reach, or six-bars, whose point passes through points in their order.

    See `mechlab.analytic.path_synthesis.path` and `sixbar_path`; each linkage is led along its path by an engine.
    """
    x = given.numbers("x", "m", 3, POINTS)
    y = given.numbers("y", "m", len(x), len(x))
    timing = np.array(given.numbers("angle", "rad", len(x), len(x))) if "angle" in given.values else None
    targets = np.array(x) + 1j * np.array(y)
    extent = given.extent(targets)
    task = PathTask(
        targets, timing, given.within("size", "m", 10.0 * extent, 0.1 * extent, 1e6 * extent),
        given.within("transmission_angle_min", "rad", np.radians(10.0), 0.0, np.radians(80.0)),
    )  # fmt: skip
    limit, six = given.integer("limit", 3, 1, 50), given.six_bar()
    bars = path_fourbars(task, part(given.progress, 0, 30 if six else 50))
    found = path_sixbars(task, bars, progress=part(given.progress, 30, 90)) if six else bars
    chosen, left_out = kept(found, task)
    exact = bool(chosen) and float(np.max(chosen[0].distances)) < EXACT * extent
    if not exact and not six:
        gears, more = kept(path_fivebars(task, bars, part(given.progress, 50, 80)), task)
        best = chosen[0].squares if chosen else np.inf
        chosen = [*chosen[:limit], *(g for g in gears if g.squares < 0.99 * best)][: 2 * limit]
        left_out = {k: n + more[k] for k, n in left_out.items()}
    most = limit if exact or six else 2 * limit
    solutions = verified_rows(given, counted(chosen, part(given.progress, 90 if six else 80, 100)), task, most, left_out)
    data = {"count": len(solutions), "solutions": solutions, "left_out": left_out, "points": len(x), "timed": task.timed}
    if not solutions:
        return SynthesisResult(given.task, Status.OUT_OF_REACH, _out_of_reach(task, left_out), data)
    text = f"{NAMED[solutions[0]['entry']]} passes through the {len(x)} points {_how(solutions[0], exact)}"
    better = next((s for s in solutions if s["entry"] == "path_fivebar"), None)
    if six and (four := kept(bars, task)[0]):
        better = {"entry": "path_fourbar", "worst": float(np.max(four[0].distances)), "squares": four[0].squares}
        data["best_fourbar"] = {k: better[k] for k in ("worst", "squares")}
    if better and better["entry"] != solutions[0]["entry"]:
        text += f", {NAMED[better['entry']]} {_how(better, better['worst'] < EXACT * extent)}"
    text += f"; left out: {left_out['branch']} that jump the branch, {left_out['order']} the order"
    names = ("entry", "worst", "squares", "least_transmission_angle", "crank_turns")
    sizes = ("crank", "coupler", "ground", *(("link", "output") if six else ()))
    rows = tuple((*(s[n] for n in names), *(s["parameters"][k] for k in sizes)) for s in solutions)
    return SynthesisResult(given.task, Status.SOLVED, text, data, (*names, *sizes), rows, tuple(s["command"] for s in solutions))


def _how(solution: Mapping[str, Any], exact: bool) -> str:
    return "exactly" if exact else f"within {solution['worst']:.4g} m (sum of squares {solution['squares']:.6g} m2)"


def _out_of_reach(task: PathTask, left_out: Mapping[str, int]) -> str:
    return (
        f"no linkage passes near these {len(task.targets)} points in their order with a transmission angle of "
        f"{np.degrees(task.least):.3g} deg and bars up to {task.size:.4g} m ({left_out['branch']} would have to be "
        f"taken apart, {left_out['order']} meet the points in another order). Try a smaller transmission_angle_min, "
        "a larger size, or fewer points"
    )


def kept(found: Iterable[PathLinkage], task: PathTask) -> tuple[list[PathLinkage], dict[str, int]]:
    """Those without a defect and with the wanted transmission angle, and how many were left out, by reason."""
    every = list(found)
    count = {k: sum(f.defect == k for f in every) for k in ("branch", "order")}
    fine = [f for f in every if not f.defect]
    # the fit keeps to the angle at the points; on the way between them it may be smaller by rounding of a limit
    chosen = [f for f in fine if f.least_transmission_angle >= task.least - 1e-9]
    return chosen, count | {"transmission_angle": len(fine) - len(chosen), "engine": 0}


def verified_rows(
    given: Given, chosen: Iterable[PathLinkage], task: PathTask, most: int, left_out: dict[str, int]
) -> list[dict[str, Any]]:
    """The first `most` linkages that an engine follows; those that it does not are counted as left out by the "engine"."""
    rows = list[dict[str, Any]]()
    for f in chosen:
        if len(rows) == most:
            break
        row = verified(given, f, task)
        if row is None:
            left_out["engine"] += 1
        else:
            rows.append(row)
    return rows


def verified(given: Given, f: PathLinkage, task: PathTask) -> dict[str, Any] | None:
    """The linkage as an entry, with what an engine measures at its points, or positions; None where the engine does not follow."""
    crank, body = f.angles + float(np.angle(complex(f.row[2], f.row[3]))), f.curve if isinstance(f.curve, GuidedBody) else None
    base = body.base if body else f.curve
    if isinstance(base, Sixbar):
        entry, sizes = "path_watt" if base.on_rocker else "path_stephenson", _six_parameters(f, base, crank)
    else:
        entry, sizes = "path_fivebar" if f.ratio else "path_fourbar", fourbar_parameters(f.row, f.mode, f.ratio, crank)
    built, link = Built(entry, rounded(sizes), crank), "link_angle" if isinstance(base, Sixbar) else "coupler_angle"
    seen = led(given.find, built, ("P_x", "P_z", *((link,) if body else ())))
    if seen is None:
        return None
    witness, values = seen
    distances, turned = f.distances, f.row[-1] / body.arm if body else 0.0
    if witness:
        there = values["P_x"] + 1j * values["P_z"]
        if body:
            there = np.stack([there, body.arm * np.exp(1j * (values[link] + turned))], axis=-1)
        distances = np.abs(there - task.aims)
    if np.max(np.abs(distances - f.distances)) > CLOSE * max(task.extent, float(np.max(np.abs(f.row)))):
        return None
    facts: dict[str, Any] = {
        "worst": float(np.max(distances)), "squares": float(np.sum(distances**2)),
        "least_transmission_angle": f.least_transmission_angle,
        "crank_turns": f.crank_turns, "crank_angles": crank.tolist(), "distances": distances.tolist(),
        "measured_by": witness or "closed form",
    }  # fmt: skip
    if body:
        off = angles_off(distances, body.arm)
        facts |= {
            "worst": float(np.max(distances[:, 0])), "worst_angle": float(np.max(off)), "distances": distances[:, 0].tolist(),
            "angle_errors": off.tolist(), "body_from_link": turned,
        }  # fmt: skip
    return replace(built, facts=facts).to_dict()


def angles_off(distances: Array, arm: float) -> Array:
    """Errors of the angle (n,) [rad] of a body from the distances (n, 2) of `PathLinkage`: chords of a circle of the arm."""
    return np.asarray(2.0 * np.arcsin(np.clip(0.5 * distances[:, 1] / arm, 0.0, 1.0)))


def fourbar_parameters(row: Array, mode: int, ratio: int, crank: Sequence[float] | Array) -> dict[str, float | int]:
    """Parameters of path_fourbar, or of path_fivebar where the ratio is not 0, from a row of `curves`."""
    o, w, d, v, p = (complex(row[k], row[k + 1]) for k in (0, 2, 4, 6, 10))
    ground = d - o
    place: dict[str, float | int] = {
        "pivot_x": o.real, "pivot_y": o.imag, "tilt": float(np.angle(ground)), "ground": abs(ground), "crank": abs(w),
    }  # fmt: skip
    end: dict[str, float | int] = {
        "mode": mode, "point": abs(p), "point_angle": float(np.angle(p)), "first": float(crank[0]), "turn": float(crank[-1] - crank[0]),
    }  # fmt: skip
    if not ratio:
        return place | {"coupler": float(row[COUPLER]), "rocker": float(row[LINK])} | end
    phase = float(np.angle(np.exp(1j * (np.angle(v) - ratio * np.angle(w)))))
    gears = {"second": abs(v), "gear_ratio": ratio, "phase": phase, "coupler": float(row[COUPLER]), "link": float(row[LINK])}
    return place | gears | end


def _six_parameters(f: PathLinkage, base: Sixbar, crank: Array) -> dict[str, float | int]:
    """Parameters of path_stephenson, or of path_watt, from a row of `sixbar`."""
    mode, side = (int(m) for m in both_modes(np.array(f.mode)))
    s, q = (complex(f.row[k], f.row[k + 1]) for k in (PIVOT, TIP))
    four = fourbar_parameters(f.row, mode, 0, crank)
    on: dict[str, float | int] = {"joint": four["point"], "joint_angle": four["point_angle"]}
    if base.on_rocker:
        on |= {"arm": abs(s), "arm_angle": float(np.angle(s))}
    else:
        on |= {"output_x": s.real, "output_y": s.imag}
    end = {"mode_output": side, "point": abs(q), "point_angle": float(np.angle(q))}
    return four | on | {"link": float(f.row[ROD]), "output": float(f.row[ARM])} | end
