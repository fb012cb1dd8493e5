"""What a map says, in plain words: theory against measurement, and how far each method can be trusted."""

from __future__ import annotations

import math

from mechlab.study.stability.data import Map, Outcome, Panel, Theory

BLOWN = frozenset({Outcome.BLOWN_UP})
BAD = frozenset({Outcome.BLOWN_UP, Outcome.WRONG, Outcome.DRIFTING, Outcome.REFUSED})


def sentences(made: Map, remark: str = "") -> tuple[str, ...]:
    """Theory against measurement first where there is theory, then each method in one sentence."""
    row = nominal_row(made)
    out = []
    if made.kind == "stiffness":
        out += [s for t in made.theory for name in t.methods if (s := _boundary(made, t, name, row))]
    out += [_summary(made, p, row) for p in made.panels]
    if remark:
        out.append(f"{remark[0].upper()}{remark[1:]}.")
    return tuple(out)


def nominal_row(made: Map) -> int:
    """The row nearest the mechanism as given; the last where it has none."""
    if made.y.nominal is None:
        return len(made.y.values) - 1
    nominal = made.y.nominal
    return min(range(len(made.y.values)), key=lambda k: abs(made.y.values[k] - nominal))


def _boundary(made: Map, theory: Theory, name: str, row: int) -> str:
    panel = made.panel(name)
    good, bad = panel.limit(row, made.x.values, BLOWN)
    limit = theory.x[row]
    if good == 0.0 and math.isinf(bad):
        return ""
    where = (
        f"between {_s(good)} and {_s(bad)}"
        if good and math.isfinite(bad)
        else f"below {_s(bad)}"
        if not good
        else f"above {_s(good)}"
    )
    return f"{name} blows up above {theory.formula} = {_s(limit)} as given; measured {where}."


def _summary(made: Map, panel: Panel, row: int) -> str:
    """How far a method is right, along the row as given and at both ends."""
    run = [c for r in panel.cells for c in r if c.outcome not in (Outcome.NOT_RUN, Outcome.REFUSED)]
    if not run:
        return f"{panel.method}: nothing could be run ({_reason(panel)})."
    right = sum(c.outcome is Outcome.RIGHT for c in run)
    blown = sum(c.outcome is Outcome.BLOWN_UP for c in run)
    if right == len(run):
        return f"{panel.method} is right in all {right} runs."
    if right == 0:
        best = min((c.value for c in run if math.isfinite(c.value)), default=math.nan)
        tail = f", blown up in {blown}" if blown else ""
        return f"{panel.method} is right in none of {len(run)} runs{tail}; the best is off by {best:.2g}."
    rows = sorted({0, row, len(made.y.values) - 1})
    limits = ", ".join(f"{_s(panel.limit(k, made.x.values, BAD)[0])} at {_y(made, k)}" for k in rows)
    return f"{panel.method} is right in {right} of {len(run)} runs and blown up in {blown}: up to {limits}."


def _reason(panel: Panel) -> str:
    reasons = [c.reason for r in panel.cells for c in r if c.reason]
    return reasons[0] if reasons else "no reason given"


def _y(made: Map, row: int) -> str:
    unit = f" {made.y.unit}" if made.y.unit else ""
    return f"{made.y.values[row]:.3g}{unit}"


def _s(h: float) -> str:
    """A timestep in words."""
    if h == 0.0:
        return "no timestep tried"
    if math.isinf(h):
        return "every timestep tried"
    return f"{1e3 * h:.3g} ms"
