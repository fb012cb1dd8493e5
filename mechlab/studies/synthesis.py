"""Synthesis: tasks that find dimensions for wanted properties. Each is a function from key=value to a
SynthesisResult."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from mechlab.analytic import burmester
from mechlab.analytic import gear_linkage as linkage
from mechlab.analytic.differential.train import closed_differential_teeth
from mechlab.analytic.planetary_synthesis import series_planets
from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.newton import Status
from mechlab.mechanism.parts import as_fraction
from mechlab.results import Shown, line_of, text_of
from mechlab.tables import number, table
from mechlab.values import Range

SHOWN = 20
LIMIT = 100
MOST_TEETH = 2000


@dataclass(frozen=True, repr=False)
class SynthesisResult(Shown):
    """The result of a task: `data` is its JSON form, `headers` and `rows` its table, `message` one sentence."""

    task: str
    status: Status
    message: str
    data: Mapping[str, Any] = field(default_factory=dict)
    headers: tuple[str, ...] = ()
    rows: tuple[tuple[Any, ...], ...] = ()

    @property
    def exit_code(self) -> int:
        """0 when dimensions were found, 4 when the wanted properties are out of reach."""
        return self.status.exit_code

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {"task": self.task, "status": self.status.value, "message": self.message, **self.data}


def synthesize(task: str, values: Mapping[str, Any]) -> SynthesisResult:
    """Run a task. Raises MechlabError for an unknown task or key, listing those that exist, or for a bad value;
    NoSolution when no dimensions have the wanted properties."""
    if task not in TASKS:
        raise unknown("the task", task, TASKS)
    keys, run = TASKS[task]
    for key in values:
        if key not in keys:
            raise unknown(f"synthesize {task}: key", key, keys)
    return run(_Given(task, values))


class _Given:
    """The given values of a task, converted and checked on access."""

    def __init__(self, task: str, values: Mapping[str, Any]) -> None:
        self.task, self.values = task, values

    def _raw(self, key: str, default: Any, what: str) -> Any:
        if key in self.values:
            return self.values[key]
        if default is None:
            raise MechlabError(f"synthesize {self.task}: {key} is missing; give {key}={what}.")
        return default

    def number(self, key: str, unit: str, default: float | None = None) -> float:
        value = self._raw(key, default, f"a number [{unit}]" if unit else "a number")
        written = getattr(value, "unit", unit)
        try:
            out = float(value)
        except (TypeError, ValueError):
            raise MechlabError(f"synthesize {self.task}: {key}: expected a number, got {value!r}.") from None
        if written != unit or not math.isfinite(out):
            raise MechlabError(f"synthesize {self.task}: {key}: expected a finite number [{unit}], got {value!r}.")
        return out

    def numbers(self, key: str, unit: str, count: int) -> list[float]:
        """A list of `count` finite numbers."""
        value = self._raw(key, None, "a,b,c ...")
        items = list(value.points()) if isinstance(value, Range) else list(value) if hasattr(value, "__iter__") else [value]
        if len(items) != count or isinstance(value, str):
            raise MechlabError(f"synthesize {self.task}: {key}: expected {count} numbers [{unit}], got {len(items)}.")
        return [_Given(self.task, {key: x}).number(key, unit) for x in items]

    def ratio(self, key: str) -> Fraction:
        return as_fraction(self._raw(key, None, "a ratio such as 6 or 17/3"), f"synthesize {self.task}: {key}")

    def integer(self, key: str, default: int | None, low: int, high: int) -> int:
        value = self.number(key, "", default)
        if value != int(value) or not low <= value <= high:
            raise MechlabError(
                f"synthesize {self.task}: {key}: expected a whole number from {low} to {high}, got {value:g}."
            )
        return int(value)

    def teeth(self, key: str, default: range) -> tuple[int, ...]:
        """Tooth counts of a number, a list, low:high (every whole number), or low:high:n (n evenly spaced numbers).

        Raises MechlabError for a count that is not a whole number from 1 to MOST_TEETH.
        """
        value = self._raw(key, default, "low:high")
        if isinstance(value, Range):
            low, high = self._whole(key, value.low), self._whole(key, value.high)
            if low > high:
                raise MechlabError(f"synthesize {self.task}: {key}: expected low:high with low <= high, got {value}.")
            return tuple(range(low, high + 1) if value.count is None else (self._whole(key, x) for x in value.points()))
        many = value if hasattr(value, "__iter__") and not isinstance(value, str) else (value,)
        return tuple(self._whole(key, x) for x in many)

    def _whole(self, key: str, value: Any) -> int:
        try:
            out = float(value)
        except (TypeError, ValueError):
            out = math.nan
        if not (1 <= out <= MOST_TEETH and out == int(out)):
            raise MechlabError(
                f"synthesize {self.task}: {key}: expected whole numbers of teeth from 1 to {MOST_TEETH}, got {value!r}."
            )
        return int(out)


def planetary(given: _Given) -> SynthesisResult:
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
    return _found(given.task, text, data, solutions)


def gear_linkage(given: _Given) -> SynthesisResult:
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
    return _found(given.task, text, data | row | {"regime": report.regime.value}, [row])


def motion(given: _Given) -> SynthesisResult:
    """Four-bars whose coupler passes through five positions exactly: see `mechlab.analytic.burmester`."""
    x, y = (given.numbers(k, "m", burmester.POSITIONS) for k in ("x", "y"))
    angles = given.numbers("angle", "rad", burmester.POSITIONS)
    places = [complex(a, b) for a, b in zip(x, y, strict=True)]
    found = burmester.leading_fourbars(places, angles)
    solutions = []
    for f in found:
        row: dict[str, Any] = {}
        for name, dyad in (("driver", f.first), ("follower", f.second)):
            row |= {f"{name}_pivot_x": dyad.pivot.real, f"{name}_pivot_y": dyad.pivot.imag, name: dyad.length}
            row |= {f"{name}_pin_x": dyad.point.real, f"{name}_pin_y": dyad.point.imag}
        solutions.append(row | {"coupler": f.coupler, "one_mode": f.same_mode})
    data = {"count": len(found), "solutions": solutions}
    if not found:
        text = "no four-bar leads a body through these five positions: they have no real circle points; change one of them a little"
        return SynthesisResult(given.task, Status.OUT_OF_REACH, text, data)
    kept = sum(f.same_mode for f in found)
    text = f"{len(found)} four-bars pass through the five positions, {kept} of them without being taken apart; pins in the axes of the body"
    return _found(given.task, text, data, solutions)


def closed_differential(given: _Given) -> SynthesisResult:
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
    return _found(given.task, text, data, solutions)


def _counts(teeth: tuple[int, ...]) -> str:
    """Tooth counts as text: low:high for a contiguous range, else a list."""
    low, high = min(teeth), max(teeth)
    return f"{low}:{high}" if len(set(teeth)) == high - low + 1 else ",".join(map(str, teeth))


def _ratios(row: list[int]) -> dict[str, float]:
    a, b = Fraction(row[0], row[0] + row[2]), Fraction(row[3], row[3] + row[5])
    return {"ratio_36_braked": float(a / b), "ratio_14_braked": float((1 - a) / (1 - b))}


def _found(task: str, message: str, data: Mapping[str, Any], solutions: list[dict[str, Any]]) -> SynthesisResult:
    base = SynthesisResult(task, Status.SOLVED, message, data)
    if not solutions:
        return base
    return replace(base, headers=tuple(solutions[0]), rows=tuple(tuple(s.values()) for s in solutions))


TASKS: dict[str, tuple[tuple[str, ...], Callable[[_Given], SynthesisResult]]] = {
    "motion": (("x", "y", "angle"), motion),
    "planetary": (("ratio", "planets", "z1", "z2", "z3", "z4", "pressure_angle_max", "limit"), planetary),
    "gear_linkage": (("coupler", "rocker", "idler_radius", "frame", "mode", *linkage.TARGETS), gear_linkage),
    "closed_differential": (
        ("ratio_36_braked", "ratio_14_braked", "planets", "teeth", "tolerance", "limit"),
        closed_differential,
    ),
}
"""Tasks by name: the keys that they take, and their function."""


@line_of.register
def _(result: SynthesisResult) -> str:
    return f"Synthesis of {result.task}: {result.message}"


@text_of.register
def _(result: SynthesisResult) -> str:
    """The sentence and a table of the first SHOWN rows."""
    parts = [f"{result.message}."]
    if result.rows:
        cells = [[number(x, 10) for x in row] for row in result.rows[:SHOWN]]
        parts.append(table(result.headers, cells))
    if len(result.rows) > SHOWN:
        parts.append(f"the first {SHOWN} of {len(result.rows)} are shown; --json has more.")
    return "\n".join(parts)
