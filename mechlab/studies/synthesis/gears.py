"""Synthesis of trains and of the three-gear four-bar: teeth for ratios, the crank for a dwell."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

from mechlab.analytic import gear_linkage as linkage
from mechlab.analytic.differential.train import closed_differential_teeth
from mechlab.analytic.planetary_synthesis import series_planets
from mechlab.errors import MechlabError
from mechlab.mechanism.newton import Status
from mechlab.studies.synthesis.given import Given
from mechlab.studies.synthesis.result import SynthesisResult, found_rows

LIMIT = 100


def planetary(given: Given) -> SynthesisResult:
    """Teeth of the series-planet gear: see `mechlab.analytic.planetary_synthesis.series_planets`."""
    ratio, planets = given.ratio("ratio"), given.integer("planets", 3, 1, 24)
    limit = given.integer("limit", LIMIT, 0, 1_000_000)
    widest = given.number("pressure_angle_max", "rad", math.radians(30.0))
    z1, z2, z3 = (given.teeth(z, r) for z, r in (("z1", range(18, 31)), ("z2", range(18, 121)), ("z3", range(18, 121))))
    z4 = given.teeth("z4", range(0)) if "z4" in given.values else None
    found = series_planets(ratio, planets, z1, z2, z3, z4, widest)
    solutions = [
        {
            "z1": int(found.z1[k]), "z2": int(found.z2[k]), "z3": int(found.z3[k]), "z4": int(found.z4[k]),
            "size": int(found.size[k]), "pressure_angle": float(found.pressure_angle[k]),
            "shift": float(found.shift[k]), "neighbours": float(found.neighbours[k]),
        }
        for k in range(min(len(found), limit))
    ]  # fmt: skip
    data = {"count": len(found), "solutions": solutions, "ratio": str(ratio), "planets": planets}
    if not len(found):
        text = (
            f"no teeth in these ranges give the ratio {ratio} with {planets} planets; "
            "widen z1, z2, z3 or pressure_angle_max, or take fewer planets"
        )
        return SynthesisResult(given.task, Status.OUT_OF_REACH, text, data)
    text = f"{len(found)} solutions for the ratio {ratio} with {planets} planets, the smallest first"
    return found_rows(given.task, text, data, solutions)


def gear_linkage(given: Given) -> SynthesisResult:
    """The crank of a three-gear four-bar for a reverse angle or a dwell."""
    targets = [t for t in linkage.TARGETS if t in given.values]
    if len(targets) != 1:
        raise MechlabError(
            f"synthesize gear_linkage: give exactly one of {', '.join(linkage.TARGETS)}; "
            f"got {', '.join(targets) or 'none'}."
        )
    target = targets[0]
    wanted = given.number(target, "rad")
    sizes = {k: given.number(k, "m") for k in ("coupler", "rocker", "idler_radius")}
    frame, mode = given.number("frame", "m", 1.0), given.integer("mode", 1, -1, 1)
    found = linkage.crank_for(target, wanted, **sizes, frame=frame, mode=mode)
    reach = {"quantity": target, "low": found.reachable[0], "high": found.reachable[1]}
    data: dict[str, Any] = {
        "crank": found.crank, "wanted": {target: wanted}, "reachable": reach,
        "momentary_crank": found.momentary_crank, "longest_crank": found.longest,
    }  # fmt: skip
    degrees = [f"{math.degrees(x):.6g}" for x in (wanted, *found.reachable)]
    if found.crank is None:
        text = (
            f"{target} = {wanted:.6g} rad ({degrees[0]} deg) is out of reach with these gears; reachable is "
            f"{found.reachable[0]:g} to {found.reachable[1]:.6g} rad ({degrees[2]} deg), next to the change point. "
            "Try another idler_radius, or other lengths of coupler and rocker"
        )
        return SynthesisResult(given.task, Status.OUT_OF_REACH, text, data)
    g = linkage.GearLinkage(found.crank, **sizes, frame=frame, mode=mode)
    report = linkage.regime(g)
    row: dict[str, Any] = {"crank": found.crank} | {
        k: getattr(report, k) for k in (*linkage.TARGETS, "least_transmission_angle")
    }
    text = f"crank = {found.crank:.10g} m gives {target} = {wanted:.6g} rad ({degrees[0]} deg)"
    return found_rows(given.task, text, data | row | {"regime": report.regime.value}, [row])


def closed_differential(given: Given) -> SynthesisResult:
    """Teeth of the closed differential for the ratios with one block braked."""
    first, second = given.ratio("ratio_36_braked"), given.ratio("ratio_14_braked")
    planets = given.integer("planets", 3, 1, 24)
    teeth = given.teeth("teeth", range(18, 201))
    tolerance = given.number("tolerance", "", 0.0)
    if tolerance < 0.0:
        raise MechlabError(f"synthesize closed_differential: tolerance: expected at least 0, got {tolerance:g}.")
    limit = given.integer("limit", LIMIT, 0, 1_000_000)
    found = closed_differential_teeth(first, second, planets, teeth, tolerance)
    names = ("z1", "z2", "z3", "z4", "z5", "z6")
    solutions: list[dict[str, Any]] = [
        dict(zip(names, row, strict=True)) | _ratios(row) for row in found.teeth[:limit].tolist()
    ]
    reach = {"quantity": "z_sun / (z_sun + z_ring)", "low": found.limits[0], "high": found.limits[1]}
    data = {
        "count": len(found.teeth), "solutions": solutions, "planets": planets, "sun_shares": [float(found.a), float(found.b)],
        "reachable": reach,
    }  # fmt: skip
    if not len(found.teeth):
        shares = ", ".join(
            f"z{k} / (z{k} + z{k + 2}) = {x} ({n} stages fit)"
            for k, x, n in zip((1, 4), (found.a, found.b), found.stages, strict=True)
        )
        text = (
            f"out of reach: these ratios demand {shares}; with {planets} planets and teeth {_counts(teeth)} a stage "
            f"has between {found.limits[0]:.6g} and {found.limits[1]:.6g}. Try tolerance=0.01, more teeth, or other ratios"
        )
        return SynthesisResult(given.task, Status.OUT_OF_REACH, text, data)
    text = (
        f"{len(found.teeth)} sets of teeth give {first} with 36 braked and {second} with 14 braked, the smallest first"
    )
    return found_rows(given.task, text, data, solutions)


def _counts(teeth: tuple[int, ...]) -> str:
    """Tooth counts as text: low:high for a contiguous range, else a list."""
    low, high = min(teeth), max(teeth)
    return f"{low}:{high}" if len(set(teeth)) == high - low + 1 else ",".join(map(str, teeth))


def _ratios(row: list[int]) -> dict[str, float]:
    a, b = Fraction(row[0], row[0] + row[2]), Fraction(row[3], row[3] + row[5])
    return {"ratio_36_braked": float(a / b), "ratio_14_braked": float((1 - a) / (1 - b))}
