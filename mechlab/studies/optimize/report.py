"""An optimum as one line and as text: the sentence, a table of start and best, the checks, the front."""

from __future__ import annotations

from mechlab.results import line_of, text_of
from mechlab.studies.optimize.problem import TriedDesign
from mechlab.studies.optimize.result import Optimum
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
