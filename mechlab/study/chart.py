"""Work-precision charts: what each method costs and how wrong it is, on one scene, under one honest protocol.

x: CPU time of stepping alone, one thread, the median of several runs, the same output times for all. y: the largest
position error against a reference of another formulation; beside it e_G, energy and loop gap, never energy alone. At
least four step sizes a method; divergence is shown as missing; an engine's defaults are always shown.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.scene import Scene
from mechlab.experiment.trace import Trace
from mechlab.study.chart_score import Reference, Score, reference_of, score
from mechlab.study.cpu_limit import OutOfTime, cpu_limit
from mechlab.study.design import Design
from mechlab.study.methods import METHODS, TOLERANCES, Method, Problem, steps
from mechlab.study.published import PUBLISHED, Published
from mechlab.study.run import versions

if TYPE_CHECKING:
    from mechlab.study.chart_peers import PeerTable

FEWEST = 4
"""Step sizes of every method, at least."""
OK, DIVERGED, NOT_RUN = "ok", "diverged", "not run"


@dataclass(frozen=True)
class Budget:
    """CPU seconds: a method is refined until one run takes `one`; no more runs after `method` seconds; repeats of the timing
    while they take less than `repeat` together."""

    one: float = 0.06
    method: float = 1.0
    repeat: float = 0.12
    repeats: int = 5


@dataclass(frozen=True)
class Point:
    """One method at one step [s] (or tolerance, see `control`); evaluations of the equations, 0 where nobody counts."""

    method: str
    step: float
    control: str
    cpu_s: float
    error: float
    e_g: float
    energy: float
    gap: float
    status: str
    reason: str = ""
    default: bool = False
    evaluations: int = 0

    @property
    def ok(self) -> bool:
        """True when there is an error to show."""
        return self.status == OK

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form; a number that is missing is null."""
        numbers = {"cpu_s": self.cpu_s, "error": self.error, "e_G": self.e_g, "energy": self.energy, "gap": self.gap}
        shown = {k: x if math.isfinite(x) else None for k, x in numbers.items()}
        head = {"method": self.method, "step": self.step, "control": self.control, **shown}
        told = {"status": self.status, "reason": self.reason, "default": self.default}
        return head | told | {"evaluations": self.evaluations or None}


@dataclass(frozen=True)
class Recommendation:
    """The cheapest point that meets the target, in words and as settings to paste."""

    point: Point
    target: float
    met: bool
    sentence: str
    paste: str

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        p = self.point.to_dict()
        named = {k: p[k] for k in ("method", "step", "control", "cpu_s", "error")}
        return named | {"target": self.target, "met": self.met, "sentence": self.sentence, "paste": self.paste}


@dataclass(frozen=True)
class Chart:
    """All points of a scene, what they are held against, and what follows."""

    name: str
    title: str
    scene: str
    duration: float
    unit: str
    tracked: tuple[str, ...]
    reference: str
    reference_error: float
    points: tuple[Point, ...]
    skipped: dict[str, str]
    recommendation: Recommendation
    notes: tuple[str, ...]
    published: tuple[Published, ...]
    versions: dict[str, str]
    peers: PeerTable | None = None

    @property
    def front(self) -> tuple[Point, ...]:
        """Points that no other beats in both cost and error, cheapest first."""
        return pareto(self.points)

    @property
    def exit_code(self) -> int:
        """0, or 3 when no method met the target."""
        return 0 if self.recommendation.met else 3

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "name": self.name, "scene": self.scene, "duration": self.duration, "error_unit": self.unit,
            "tracked": list(self.tracked), "reference": {"text": self.reference, "error": self.reference_error},
            "points": [p.to_dict() for p in self.points], "front": [p.to_dict() for p in self.front],
            "recommendation": self.recommendation.to_dict(), "notes": list(self.notes), "skipped": dict(self.skipped),
            "published": [p.to_dict() for p in self.published], "versions": self.versions,
            "status": "answered" if self.recommendation.met else "no method meets the target",
            "message": self.recommendation.sentence,
            **({} if self.peers is None else self.peers.to_dict()),
        }  # fmt: skip

    def text(self) -> str:
        """The table for a person."""
        from mechlab.study.chart_files import chart_text

        return chart_text(self)

    def _repr_html_(self) -> str:
        from mechlab.study.chart_files import chart_html

        return chart_html(self)

    def save(self, path: Any) -> dict[str, Any]:
        """Write picture, table and data; see `mechlab.study.chart_files.save`."""
        from mechlab.study.chart_files import save

        return save(self, path)


def pareto(points: Sequence[Point]) -> tuple[Point, ...]:
    """The points that none other beats in both cost and error, cheapest first."""
    out: list[Point] = []
    for p in sorted((p for p in points if p.ok), key=lambda p: (p.cpu_s, p.error)):
        if not out or p.error < out[-1].error:
            out.append(p)
    return tuple(out)


def chart(
    design: Design,
    scene: str | None = None,
    *,
    fidelity: str | None = None,
    duration: float | None = None,
    target: float | None = None,
    budget: Budget | None = None,
    methods: Sequence[Method] = METHODS,
    peers: bool = False,
    progress: Callable[[str], None] = lambda line: None,
) -> Chart:
    """The chart of a scene. target [m or rad]: the error that the recommendation must meet (default: the scene's).

    peers: compare error control with other people's engines (`mechlab.study.chart_peers`), as far as they are installed.
    Raises MechlabError for unknown names, or when there is nothing to hold the methods against.
    """
    if target is not None and not target > 0:
        raise MechlabError(f"target: expected an error > 0, got {target!r}.")
    lived = design.for_scene(scene)
    made = lived.scene(scene, fidelity, duration)
    problem = Problem(lived, made)
    progress("reference")
    truth = reference_of(problem)
    points: list[Point] = []
    skipped: dict[str, str] = {}
    for m in methods:
        why = m.available(problem)
        if why:
            skipped[m.name] = why
            continue
        progress(m.name)
        values = steps(problem) if m.control == "step" else TOLERANCES
        points += sweep(m.name, m.control, m.is_default, values, *_work(m, problem, truth), budget or Budget())
    aim = made.tolerance if target is None else target
    changed = bool(design.given) or duration is not None
    names = {m.name: m for m in METHODS}
    others = _compare(problem, truth, progress) if peers else None
    error, confirmed = _confirm(points, truth, {n for n, m in names.items() if m.engine == "analytic"})
    return Chart(
        design.name, design.entry.title, made.name, made.duration, truth.unit, truth.names, truth.text + confirmed, error,
        (*points, *(others.points if others else ())), skipped | (others.skipped if others else {}),
        recommend(points, aim, truth.unit), tuple(flat_defaults(points, aim, truth.unit, _has_rows(design, made))),
        () if changed else PUBLISHED.get(design.name, ()), versions(), others,
    )  # fmt: skip


def _compare(problem: Problem, truth: Reference, progress: Callable[[str], None]) -> PeerTable:
    from mechlab.study.chart_peers import compare

    return compare(problem, truth, progress)


def _work(m: Method, problem: Problem, truth: Reference) -> tuple[Callable[[float], Trace], Callable[[Trace], Score]]:
    return lambda value: m.run(problem, value), lambda trace: score(problem, truth, trace)


def sweep(
    name: str,
    control: str,
    default: bool,
    values: Sequence[float],
    run: Callable[[float], Trace],
    judge: Callable[[Trace], Score],
    budget: Budget,
) -> list[Point]:
    """A method at ever smaller values. Refinement ends with the budget; the first FEWEST values are always told of."""
    out: list[Point] = []
    began = time.process_time()
    for k, value in enumerate(values):
        left = budget.method - (time.process_time() - began)
        if left <= 0.0:
            if k < FEWEST:
                out.append(_missing(name, value, control, NOT_RUN, f"{budget.method:g} s of CPU were spent", default))
            continue
        try:
            with cpu_limit(left):
                trace = run(value)
        except OutOfTime as late:
            if k < FEWEST:
                out.append(_missing(name, value, control, NOT_RUN, str(late), default))
            continue
        except (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError) as problem:
            # a state that ran away: Python's floats raise where numpy's become infinite
            out.append(_missing(name, value, control, DIVERGED, str(problem), default))
            continue
        found = judge(trace)
        if not math.isfinite(found.error):
            why = trace.reason or "the state is not finite"
            out.append(_missing(name, value, control, DIVERGED, why, default))
            continue
        cpu = _median(run, value, trace.cpu_s, budget)
        numbers = (cpu, found.error, found.e_g, found.energy, found.gap)
        out.append(Point(name, value, control, *numbers, OK, "", default, getattr(trace, "evaluations", 0)))
        if sum(p.ok for p in out) >= FEWEST and cpu > budget.one:
            break
    return out


def _missing(name: str, value: float, control: str, status: str, reason: str, default: bool) -> Point:
    nan = math.nan
    return Point(name, value, control, nan, nan, nan, nan, nan, status, reason, default)


def _median(run: Callable[[float], Trace], value: float, first: float, budget: Budget) -> float:
    """Median CPU time of the stepping over as many runs as the budget allows (an odd number)."""
    times = [first]
    while len(times) < budget.repeats and sum(times) + 2 * first < budget.repeat:
        times += [run(value).cpu_s, run(value).cpu_s]
    return statistics.median(times)


def _confirm(points: Sequence[Point], truth: Reference, own: set[str]) -> tuple[float, str]:
    """The error of the reference as far as it is known: another formulation agrees to this."""
    others = [p for p in points if p.ok and p.method not in own and p.error > 0.0]
    mine = [p for p in points if p.ok and p.method in own]
    known = [] if math.isnan(truth.own_error) else [truth.own_error]
    text = ""
    if mine:
        sharpest = min(mine, key=lambda p: p.error)
        known.append(max(sharpest.error, 1e-15))
        text = f"; itself at tolerance {sharpest.step:.0e}: {sharpest.error:.1e}"
    if others:
        best = min(others, key=lambda p: p.error)
        known.append(best.error)
        text += f"; {best.method} agrees to {best.error:.1e}"
    return min(known, default=math.nan), text


def _has_rows(design: Design, scene: Scene) -> bool:
    m = design.mechanism(scene.fidelity)
    return bool(m.loops or m.relations)


def flat_defaults(points: Sequence[Point], target: float, unit: str, rows: bool = True) -> list[str]:
    """Sentences on engines whose defaults stay wrong however small the step: the model is wrong there, not the step.

    rows: the mechanism has loops or relations; without them what is soft is the dry friction.
    """
    soft = "The loops are springs" if rows else "Dry friction is a soft row too and creeps"
    out = []
    flat: list[Point] = []
    for name in dict.fromkeys(p.method for p in points if p.default and p.control == "step"):
        mine = [p for p in points if p.method == name and p.ok]
        if len(mine) >= FEWEST and is_flat(mine, target):
            flat += mine
    if flat:
        small, large = min(p.step for p in flat), max(p.step for p in flat)
        low, high = min(p.error for p in flat), max(p.error for p in flat)
        error = f"{high:.2g}" if high < 1.5 * low else f"{low:.2g} to {high:.2g}"
        count = len({p.method for p in flat})
        out.append(
            f"MuJoCo's default softness does not converge here: {error} {unit} of error at every timestep from "
            f"{1e3 * large:.3g} ms down to {1e3 * small:.3g} ms, with {count} integrators. {soft}; a smaller "
            "step simulates the wrong mechanism more precisely."
        )
    return out


def is_flat(points: Sequence[Point], target: float) -> bool:
    """Errors of one method at ever smaller steps do not fall: the last half no better than a third of the best before."""
    errors = [p.error for p in sorted(points, key=lambda p: -p.step)]
    half = len(errors) // 2
    return min(errors) > 10.0 * target and min(errors[half:]) > 0.3 * min(errors[:half])


def recommend(
    points: Sequence[Point], target: float, unit: str, paste: Callable[[Point], str] | None = None
) -> Recommendation:
    """The cheapest point that meets the target; one that its own smaller steps confirm, if it costs no more than half as
    much again. The most accurate point when none meets it."""
    usable = [p for p in points if p.ok]
    if not usable:
        raise MechlabError("chart: no method came through; the problem is too hard for every step tried.")
    good = sorted((p for p in usable if p.error <= target), key=lambda p: p.cpu_s)
    if not good:
        best = min(usable, key=lambda p: p.error)
        text = f"No method meets {target:g} {unit} here; the best is {_told(best)} with {best.error:.2g} {unit} in {best.cpu_s:.3g} s."
        return Recommendation(best, target, False, text, _paste(best, points, target, paste))
    steady = [p for p in good if p.cpu_s <= 1.5 * good[0].cpu_s and _confirmed(p, points, target)]
    chosen = steady[0] if steady else good[0]
    text = f"For {target:g} {unit}: {_told(chosen)}, {chosen.error:.2g} {unit} in {chosen.cpu_s:.3g} s of CPU."
    if not steady:
        text += " Take care: with a smaller step this method misses the target; its error does not fall steadily here."
    return Recommendation(chosen, target, True, text, _paste(chosen, points, target, paste))


def _confirmed(p: Point, points: Sequence[Point], target: float) -> bool:
    finer = [x for x in points if x.method == p.method and x.step < p.step]
    return all(x.ok and x.error <= target for x in finer if x.status != NOT_RUN)


def _told(p: Point) -> str:
    return f"{p.method}, step {p.step:.6g} s" if p.control == "step" else f"{p.method}, tolerance {p.step:.0e}"


def _paste(chosen: Point, points: Sequence[Point], target: float, paste: Callable[[Point], str] | None) -> str:
    """MJCF settings of the chosen point, or of the cheapest MuJoCo point that meets the target."""
    mine = [p for p in points if p.ok and p.method.startswith("MuJoCo")]
    if not mine:
        return ""
    good = [p for p in mine if p.error <= target]
    best = chosen if chosen in mine else min(good, key=lambda p: p.cpu_s) if good else min(mine, key=lambda p: p.error)
    return (paste or mjcf_settings)(best)


def mjcf_settings(p: Point) -> str:
    """An <option> line, and for hard loops the constraint attributes, as MJCF."""
    integrator = p.method.removeprefix("MuJoCo ").split(",")[0]
    lines = [f'<option timestep="{p.step:.10g}" integrator="{integrator}" jacobian="dense"/>']
    if not p.default and p.method.endswith("hard"):
        soft = f'solref="{2 * p.step:.10g} 1" solimp="0.9999 0.9999 0.001 0.5 2"'
        lines.append(f"<default><equality {soft}/></default>")
    return "\n".join([f"<!-- {p.method}: error {p.error:.2g}, {p.cpu_s:.3g} s of CPU -->", *lines])


__all__ = [
    "Budget",
    "Chart",
    "Point",
    "Recommendation",
    "chart",
    "flat_defaults",
    "mjcf_settings",
    "pareto",
    "recommend",
    "sweep",
]
