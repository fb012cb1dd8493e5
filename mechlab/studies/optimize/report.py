"""An optimum as one line, as text (the sentence, a table of start and best, the checks, the front), and the front as a table and
as a picture of all designs that were tried."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from mechlab.results import line_of, text_of
from mechlab.studies.named.number import parameter_infos
from mechlab.studies.optimize.problem import TriedDesign
from mechlab.studies.optimize.result import Optimum
from mechlab.studies.picture_style import new_figure, open_frame, save_figure
from mechlab.tables import number, table


@line_of.register
def _(found: Optimum) -> str:
    return f"Optimum of {found.message}"


@text_of.register
def _(found: Optimum) -> str:
    """The sentence, a table of start and best, the checks, the front."""
    p = found.problem
    lines = [f"task: {found.task}"] if found.task else []
    lines.append(f"{found.message}.")
    shown = found.best or found.nearest
    head = "best" if found.best else "nearest"
    if shown is not None:
        rows = [
            (v.name, v.unit, f"{v.low:.6g} .. {v.high:.6g}", number(a, 9), number(b, 9))
            for v, a, b in zip(p.variables, found.start.x, shown.x, strict=True)
        ]
        limits: dict[str, list[str]] = {}
        for c in p.constraints:
            limits.setdefault(c.quantity, []).append(f"{'>=' if c.sign > 0 else '<='} {c.bound:.6g}")
        for q, unit in p.measured.units.items():
            if q in found._named(shown) and q != p.goal.quantity:
                continue
            wanted = [p.goal.text.split()[0]] if q == p.goal.quantity else []
            about = ", ".join(wanted + limits.get(q, []))
            rows.append((q, unit, about, number(found.start.values.get(q), 9), number(shown.values.get(q), 9)))
        lines.append(table(("quantity", "unit", "range or wish", "start", head), rows))
    if found.start.failure:
        lines.append(f"start: {found.start.failure}")
    for q, others in found.checks.items():
        lines.append(f"checked: {q} = {', '.join(f'{v:.9g} ({way})' for way, v in others.items())}")
    lines.append(f"{len(p.trials)} designs evaluated, seed {found.seed}")
    if found.second is not None and found.front:
        names = [v.name for v in p.variables]
        both = [p.goal.quantity, found.second.quantity]
        cells = [[*(number(t.values[q], 6) for q in both), *(number(a, 6) for a in t.x)] for t in found.front]
        lines += [
            f"front of {p.goal.text} and {found.second.text}, without a bound on {found.second.quantity}:",
            table((*both, *names), cells),
        ]
    lines += [f"{k}: {f}" for k, f in found.files.items()]
    return "\n".join([*lines, *(f"warning: {w}" for w in found.warnings)])


def rows(found: Optimum) -> list[list[str]]:
    """The front as a table in SI with a header row: goals, other quantities, variables."""
    assert found.second is not None
    p = found.problem
    first = [p.goal.quantity, found.second.quantity]
    names = list(dict.fromkeys([*first, *p.measured.units]))
    head = [f"{n} [{u}]" if (u := p.measured.units.get(n, "")) else n for n in names]
    head += [f"{v.name} [{v.unit}]" if v.unit else v.name for v in p.variables]
    return [head, *(_row(t, names) for t in found.front)]


def _row(t: TriedDesign, names: list[str]) -> list[str]:
    return [repr(float(x)) for x in (*(t.values[n] for n in names), *t.x)]


BLUE, ORANGE, GREY, DARK = "#1d4ed8", "#d97706", "#b8bec8", "#222222"


def draw(found: Optimum, path: Path) -> Path:
    """Write the picture; the suffix of the path says whether SVG or PNG. Angles are drawn in degrees."""
    from matplotlib import rc_context

    assert found.second is not None
    p, second = found.problem, found.second
    names = (p.goal.quantity, second.quantity)
    units = [p.measured.units.get(n, "") for n in names]
    scale = np.array([np.degrees(1.0) if u == "rad" else 1.0 for u in units])

    def points(trials: Any) -> Any:
        return np.array([[t.values[n] for n in names] for t in trials]).reshape(-1, 2) * scale

    figure = new_figure(8.2, 6.4)
    axes = figure.add_axes((0.11, 0.2, 0.85, 0.63))
    others = tuple(c for c in p.constraints if c.quantity != second.quantity)
    front = points(found.front)
    low, high = _window(front, points([found.start] if not found.start.failure else []))
    tried = points([t for t in p.trials.values() if t.meets(others)])
    axes.plot(tried[:, 0], tried[:, 1], ".", color=GREY, ms=3.5, mew=0, label="tried, constraints kept", zorder=1)
    axes.plot(front[:, 0], front[:, 1], "o-", color=BLUE, ms=6, lw=1.6, label="front: no design beats these", zorder=3)
    if not found.start.failure:
        start = points([found.start])
        kept = "" if found.start.meets(others) else ", breaks a constraint"
        axes.plot(start[:, 0], start[:, 1], "X", color=DARK, ms=9, label=f"start{kept}", zorder=4)
    for c in p.constraints:
        if c.quantity == second.quantity:
            axes.axhline(
                c.bound * scale[1], color=ORANGE, lw=1.2, ls="--", zorder=2, label=f"asked for: {_bound(c, units[1])}"
            )
            if found.best is not None:
                best = points([found.best])
                axes.plot(best[:, 0], best[:, 1], "D", color=ORANGE, ms=8, mec="white", label="best under it", zorder=5)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    labels: tuple[Any, Any] = (axes.set_xlabel, axes.set_ylabel)
    for k, (name, unit, put) in enumerate(zip(names, units, labels, strict=True)):
        sign = (p.goal.sign, second.sign)[k]
        shown = "deg" if unit == "rad" else unit
        better = ("right" if sign > 0 else "left") if k == 0 else ("up" if sign > 0 else "down")
        put(f"{name.replace('_', ' ')}{f', {shown}' if shown else ''}   (better: {better})", fontsize=10)
    axes.grid(color="#e6e8ec", lw=0.7)
    axes.set_axisbelow(True)
    open_frame(axes)
    title = f"{p.goal.text} against {names[1]}".replace("_", " ")
    figure.text(0.11, 0.955, f"{title[0].upper()}{title[1:]}", fontsize=13, weight="bold")
    chosen = f"{p.base.entry.title}. {_fixed(found)}"
    chosen += f"Free: {', '.join(f'{v.name} {v.low:g} to {v.high:g} {v.unit}' for v in p.variables)}."
    bound = f" Kept: {', '.join(_bound(c, p.measured.units[c.quantity]) for c in others)}." if others else ""
    figure.text(
        0.11,
        0.935,
        fill((chosen + bound).replace("_", " "), 105),
        fontsize=8.8,
        color="#444444",
        va="top",
        linespacing=1.3,
    )
    figure.legend(loc="lower left", bbox_to_anchor=(0.1, 0.012), ncol=3, fontsize=9, frameon=False)
    with rc_context({"svg.hashsalt": "mechlab"}):
        return save_figure(figure, path, metadata={"Date": None} if path.suffix == ".svg" else None)


def _fixed(found: Optimum) -> str:
    """Text on the parameters that the user or the task fixed; angles in degrees."""
    infos = parameter_infos(found.problem.base)
    free = {v.name for v in found.problem.variables}
    set_ = {k: v for k, v in found.problem.base.given.items() if k not in free and isinstance(v, int | float)}
    both = {k: (v, infos[k].unit) for k, v in set_.items()}
    words = [
        f"{k} {np.degrees(v):.4g} deg" if u == "rad" else f"{k} {v:.4g} {u}".rstrip() for k, (v, u) in both.items()
    ]
    return f"Fixed: {', '.join(words)}. " if words else ""


def _window(front: Any, start: Any) -> tuple[Any, Any]:
    """Lower and upper limits of the axes: the front and the start with a margin; designs far outside are not shown."""
    both = np.vstack([front, start])
    low, high = both.min(axis=0), both.max(axis=0)
    room = 0.08 * np.where(high > low, high - low, np.maximum(np.abs(high), 1.0))
    return low - room, high + room


def _bound(c: Any, unit: str) -> str:
    value = np.degrees(c.bound) if unit == "rad" else c.bound
    shown = " deg" if unit == "rad" else f" {unit}" if unit else ""
    return f"{c.quantity.replace('_', ' ')} {'≥' if c.sign > 0 else '≤'} {value:g}{shown}"
