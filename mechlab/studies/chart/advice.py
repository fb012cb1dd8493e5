"""What follows from the points of a chart: defaults that do not converge, and the setting to take."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mechlab.errors import MechlabError
from mechlab.studies.chart.data import FEWEST, NOT_RUN, Chart, ChartPoint, Recommendation
from mechlab.tables import counted


def flat_defaults(points: Sequence[ChartPoint], target: float, unit: str, rows: bool = True) -> list[str]:
    """A sentence on MuJoCo's default settings where their error does not fall with the timestep; an empty list where it
    does.

    rows: True when the mechanism has loops or relations, which are then the soft part; else the soft part is dry
    friction.
    """
    flat = [p for many in flat_by_method(points, target).values() for p in many]
    if not flat:
        return []
    small, large = min(p.step for p in flat), max(p.step for p in flat)
    low, high = min(p.error for p in flat), max(p.error for p in flat)
    error = f"{high:.2g}" if high < 1.5 * low else f"{low:.2g} to {high:.2g}"
    count = len({p.method for p in flat})
    soft = "The loops are springs" if rows else "Dry friction is a soft row too and creeps"
    return [
        f"MuJoCo's default softness does not converge here: {error} {unit} of error at every timestep from "
        f"{1e3 * large:.3g} ms down to {1e3 * small:.3g} ms, with {counted(count, 'integrator')}. {soft}; a smaller "
        "step simulates the wrong mechanism more precisely."
    ]


def flat_by_method(points: Sequence[ChartPoint], target: float) -> dict[str, list[ChartPoint]]:
    """Methods at an engine's defaults whose error does not fall however small the step: name -> its points, largest
    step first."""
    out = {}
    for name in dict.fromkeys(p.method for p in points if p.default and p.control == "step"):
        mine = sorted((p for p in points if p.method == name and p.ok), key=lambda p: -p.step)
        if len(mine) >= FEWEST and is_flat(mine, target):
            out[name] = mine
    return out


def is_flat(points: Sequence[ChartPoint], target: float) -> bool:
    """True when the error of a method does not fall with the step: the least error of the finer half of its steps is
    above 10 times the target and above 0.3 times the least error of the coarser half."""
    errors = [p.error for p in sorted(points, key=lambda p: -p.step)]
    half = len(errors) // 2
    return min(errors) > 10.0 * target and min(errors[half:]) > 0.3 * min(errors[:half])


def recommend(
    points: Sequence[ChartPoint], target: float, unit: str, paste: Callable[[ChartPoint], str] | None = None
) -> Recommendation:
    """The cheapest point that meets the target, or the most accurate point when none does.

    A point whose method meets the target at every smaller step too is preferred if it costs at most 1.5 times as much.
    Raises MechlabError when no run reached the end.
    """
    usable = [p for p in points if p.ok]
    if not usable:
        raise MechlabError("chart: no method came through; the problem is too hard for every step tried.")
    good = sorted((p for p in usable if p.error <= target), key=lambda p: p.cpu_s)
    if not good:
        best = min(usable, key=lambda p: p.error)
        text = f"No method meets {target:g} {unit} here; the best is {_setting(best)} with {best.error:.2g} {unit} in {best.cpu_s:.3g} s."
        return Recommendation(best, target, False, text, _paste(best, points, target, paste))
    steady = [p for p in good if p.cpu_s <= 1.5 * good[0].cpu_s and _confirmed(p, points, target)]
    chosen = steady[0] if steady else good[0]
    text = f"For {target:g} {unit}: {_setting(chosen)}, {chosen.error:.2g} {unit} in {chosen.cpu_s:.3g} s of CPU."
    if not steady:
        text += " Take care: with a smaller step this method misses the target; its error does not fall steadily here."
    return Recommendation(chosen, target, True, text, _paste(chosen, points, target, paste))


def _confirmed(p: ChartPoint, points: Sequence[ChartPoint], target: float) -> bool:
    finer = [x for x in points if x.method == p.method and x.step < p.step]
    return all(x.ok and x.error <= target for x in finer if x.status != NOT_RUN)


def _setting(p: ChartPoint) -> str:
    return f"{p.method}, step {p.step:.6g} s" if p.control == "step" else f"{p.method}, tolerance {p.step:.0e}"


def _paste(
    chosen: ChartPoint, points: Sequence[ChartPoint], target: float, paste: Callable[[ChartPoint], str] | None
) -> str:
    """MJCF settings of the chosen point, or of the cheapest MuJoCo point that meets the target."""
    mine = [p for p in points if p.ok and p.method.startswith("MuJoCo")]
    if not mine:
        return ""
    good = [p for p in mine if p.error <= target]
    best = chosen if chosen in mine else min(good, key=lambda p: p.cpu_s) if good else min(mine, key=lambda p: p.error)
    return (paste or mjcf_settings)(best)


def mjcf_settings(p: ChartPoint) -> str:
    """An <option> line, and for hard loops the constraint attributes, as MJCF."""
    integrator = p.method.removeprefix("MuJoCo ").split(",")[0]
    lines = [f'<option timestep="{p.step:.10g}" integrator="{integrator}" jacobian="dense"/>']
    if not p.default and p.method.endswith("hard"):
        soft = f'solref="{2 * p.step:.10g} 1" solimp="0.9999 0.9999 0.001 0.5 2"'
        lines.append(f"<default><equality {soft}/></default>")
    return "\n".join([f"<!-- {p.method}: error {p.error:.2g}, {p.cpu_s:.3g} s of CPU -->", *lines])


def flat_methods(chart: Chart) -> dict[str, list[ChartPoint]]:
    """`flat_by_method` of the points of a chart, under its target."""
    return flat_by_method(chart.points, chart.recommendation.target)


def final_error(flat: dict[str, list[ChartPoint]], unit: str) -> str:
    """The error that flat methods keep at their smallest steps, or its range."""
    last = [points[-1].error for points in flat.values()]
    low, high = with_prefix(min(last), unit), with_prefix(max(last), unit)
    return low if max(last) < 1.2 * min(last) else f"{low} to {high}"


PREFIXES = ((1e-12, "p"), (1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"))


def with_prefix(value: float, unit: str, digits: int = 2) -> str:
    """A number with a prefix to its unit: 2.5e-05 m is 25 µm."""
    if not 1e-13 < abs(value) < 1e6:
        return f"{value:.{digits}g} {unit}"
    shown = float(f"{value:.{digits}g}")
    scale, prefix = next((p for p in reversed(PREFIXES) if abs(shown) >= p[0] * (1 - 1e-9)), PREFIXES[0])
    return f"{shown / scale:.{max(digits, 3)}g} {prefix}{unit}"


def headline(chart: Chart) -> str:
    """The chart in one sentence: the error of defaults that do not converge; else the CPU time that the target
    costs."""
    flat = flat_methods(chart)
    if flat:
        return f"{_whose(chart, flat)} stay {final_error(flat, chart.unit)} wrong, however small the step"
    p, target = chart.recommendation.point, with_prefix(chart.recommendation.target, chart.unit, 1)
    if not chart.recommendation.met:
        return f"No method comes within {target} here"
    return f"An error below {target} costs {with_prefix(p.cpu_s, 's')} of CPU with {p.method}"


def _whose(chart: Chart, flat: dict[str, list[ChartPoint]]) -> str:
    """Subject of the headline: the file's settings, MuJoCo's defaults, or its defaults with the integrators by name."""
    if any("as in the file" in n for n in flat):
        return "The file's own settings"
    through = {p.method for p in chart.points if p.default and p.ok}
    if through == set(flat):
        return "MuJoCo's defaults"
    names = [n.removeprefix("MuJoCo ").split(",")[0] for n in flat]
    return f"MuJoCo's defaults with {' and '.join([', '.join(names[:-1]), names[-1]] if names[1:] else names)}"
