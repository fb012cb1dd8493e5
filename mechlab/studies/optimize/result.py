"""The result of an optimisation: the best design, the start, active bounds, checks, the front; or why there is none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Status
from mechlab.results import Shown
from mechlab.studies.named.number import parameter_values
from mechlab.studies.optimize.problem import OptimisationGoal, OptimisationProblem, QuantityBound, TriedDesign

ACTIVE = 1e-4
"""A constraint (or the end of a range) is active when the best design is this close to it, relative to the bound
(range)."""
AGREES = 1e-6
"""Largest relative difference allowed between the reported number and another way to compute it."""


@dataclass(frozen=True, repr=False)
class Optimum(Shown):
    """The result of an optimization. best: None where no design meets the constraints; nearest: then the design that
    violates them least. checks: quantity -> other way to compute it -> value at the best design. front: non-dominated
    designs of the goal and `second`."""

    problem: OptimisationProblem
    best: TriedDesign | None
    start: TriedDesign
    seed: int
    nearest: TriedDesign | None = None
    checks: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    second: OptimisationGoal | None = None
    front: tuple[TriedDesign, ...] = ()
    task: str = ""
    given: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, Path] = field(default_factory=dict)

    @property
    def exit_code(self) -> int:
        """0; 3 when a check disagrees; 4 when no design meets the constraints."""
        return 4 if self.best is None else 3 if self.disagreement else 0

    @property
    def disagreement(self) -> str:
        """A sentence on the first quantity for which another way to compute it disagrees; empty when all agree."""
        if self.best is None:
            return ""
        for name, others in self.checks.items():
            value = self.best.values[name]
            limit = self.tolerances.get(name, AGREES) * max(abs(value), 1e-9)
            for way, other in others.items():
                if not abs(other - value) <= limit:
                    return f"{name} is {value:.9g}, but {other:.9g} as computed by {way}"
        return ""

    @property
    def tolerances(self) -> dict[str, float]:
        """Quantity -> relative difference allowed instead of AGREES: 1e-2 for quantities of a cycle."""
        return {n: 1e-2 for n in self.checks if n.startswith("cycle.")}

    @property
    def parameters(self) -> dict[str, float]:
        """The variables of the best design."""
        if self.best is None:
            return {}
        return dict(zip((v.name for v in self.problem.variables), self.best.x, strict=True))

    @property
    def active(self) -> tuple[str, ...]:
        """Active constraints and active ends of ranges at the best design."""
        if self.best is None:
            return ()
        out = [c.text for c in self.problem.constraints if c.slack(self.best.values) <= ACTIVE]
        for v, x in zip(self.problem.variables, self.best.x, strict=True):
            for end, name in ((v.low, "lowest"), (v.high, "highest")):
                if abs(x - end) <= ACTIVE * (v.high - v.low):
                    out.append(f"{v.name} at its {name} value {end:.9g}")
        return tuple(out)

    @property
    def message(self) -> str:
        """What was found, in one sentence."""
        p = self.problem
        if self.best is None:
            return f"{p.base.name}: {infeasible(p, self.nearest)}"
        if self.disagreement:
            return f"{p.base.name}: do not trust the optimum: {self.disagreement}"
        g = p.goal.quantity
        what = ", ".join(f"{k} = {v:.6g}" for k, v in self.parameters.items())
        before = f" (start: {with_unit(self.start.values[g], self.unit(g))})" if g in self.start.values else ""
        held = f"; held by {', '.join(self.active)}" if self.active else "; no constraint is active"
        return f"{p.base.name}: {p.goal.text} is {with_unit(self.best.values[g], self.unit(g))}{before} at {what}{held}"

    def unit(self, quantity: str) -> str:
        """Unit of a quantity."""
        return self.problem.measured.units.get(quantity, "")

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        p = self.problem
        fixed = parameter_values(p.base)
        out: dict[str, Any] = {
            "status": Status.SOLVED.value if self.best else "infeasible", "message": self.message, "task": self.task,
            "goal": {"quantity": p.goal.quantity, "sense": "largest" if p.goal.sign > 0 else "smallest"},
            "variables": {v.name: {"low": v.low, "high": v.high, "unit": v.unit} for v in p.variables},
            "constraints": [c.text for c in p.constraints],
            "best": None if self.best is None else {"parameters": self.parameters, "quantities": dict(self.best.values)},
            "start": {"parameters": self._named(self.start), "quantities": dict(self.start.values)},
            "active": list(self.active), "checks": {k: dict(v) for k, v in self.checks.items()},
            "evaluations": len(p.trials), "seed": self.seed, "given": dict(self.given),
            "units": {v.name: v.unit for v in p.variables} | dict(p.measured.units),
            "parameters": fixed | self.parameters, "warnings": list(self.warnings),
        }  # fmt: skip
        if self.start.failure:
            out["start"]["failure"] = self.start.failure
        if self.best is None and self.nearest is not None:
            out["nearest"] = {
                "parameters": self._named(self.nearest), "quantities": dict(self.nearest.values),
                "missed": missed(p.constraints, self.nearest),
            }  # fmt: skip
        if self.second is not None:
            out["front"] = {
                "goals": [p.goal.text, self.second.text],
                "designs": [{"parameters": self._named(t), "quantities": dict(t.values)} for t in self.front],
            }
        return out | ({"files": {k: str(f) for k, f in self.files.items()}} if self.files else {})

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of the best design."""
        return () if self.best is None else self.problem.design(self.best.x).warnings

    def _named(self, t: TriedDesign) -> dict[str, float]:
        return dict(zip((v.name for v in self.problem.variables), t.x, strict=True))


def with_unit(value: float, unit: str) -> str:
    """A number with its unit, angles in degrees too."""
    if unit == "rad":
        return f"{value:.6g} rad ({math.degrees(value):.5g} deg)"
    return f"{value:.6g} {unit}".rstrip()


def missed(constraints: tuple[QuantityBound, ...], t: TriedDesign) -> dict[str, float]:
    """Violated constraint -> value of its quantity."""
    return {c.text: t.values[c.quantity] for c in constraints if not t.failure and c.slack(t.values) < 0.0}


def infeasible(p: OptimisationProblem, nearest: TriedDesign | None) -> str:
    """Sentences: which constraints cannot be met in these ranges, and the nearest design."""
    known = [t for t in p.trials.values() if not t.failure]
    if nearest is None or not known:
        reasons = [t.failure for t in p.trials.values() if t.failure]
        commonest = max(set(reasons), key=reasons.count) if reasons else "nothing was tried"
        return f"none of {len(p.trials)} designs in these ranges has the quantities asked for; for example: {commonest}"
    alone = []
    for c in p.constraints:
        best = max((t.values[c.quantity] for t in known), key=lambda value: c.sign * value)
        if c.sign * (best - c.bound) < 0.0:
            alone.append(f"{c.text} cannot be met in these ranges: the {'largest' if c.sign > 0 else 'smallest'} "
                         f"{c.quantity} found is {with_unit(best, p.measured.units[c.quantity])}")  # fmt: skip
    where = ", ".join(f"{v.name} = {x:.6g}" for v, x in zip(p.variables, nearest.x, strict=True))
    values = ", ".join(
        f"{c.quantity} = {with_unit(nearest.values[c.quantity], p.measured.units[c.quantity])}" for c in p.constraints
    )
    reason = "; ".join(alone) or (
        f"each of {', '.join(c.text for c in p.constraints)} can be met, but not all of them in one design"
    )
    return f"{reason}. Nearest: {values} at {where}. Widen a range or relax a constraint"
