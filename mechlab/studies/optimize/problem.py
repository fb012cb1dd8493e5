"""An optimization as data: variables, goal, bounds, every design that was tried; and predefined tasks of mechanisms."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError, UsageError, unknown
from mechlab.experiment.parameters import coerce
from mechlab.lab.design import Design
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.named.number import SINGLE_NUMBERS, parameter_infos, varied
from mechlab.studies.optimize.quantity import QuantitySet
from mechlab.values import Range, parse_number

MET = 1e-8
"""A constraint holds when its violation is at most this share of its bound."""
_CONSTRAINT = re.compile(r"\s*([\w.\[\] -]+?)\s*(>=|<=)\s*(\S.*)")


@dataclass(frozen=True)
class DesignVariable:
    """A parameter that the search may choose from low to high [unit]; whole: whole numbers only."""

    name: str
    low: float
    high: float
    unit: str = ""
    whole: bool = False


@dataclass(frozen=True)
class OptimisationGoal:
    """A quantity to be made as large (sign 1) or as small (-1) as possible."""

    quantity: str
    sign: int = 1

    @property
    def text(self) -> str:
        """The goal in words."""
        return f"{'largest' if self.sign > 0 else 'smallest'} {self.quantity}"


@dataclass(frozen=True)
class QuantityBound:
    """quantity >= bound (sign 1) or <= bound (-1)."""

    quantity: str
    sign: int
    bound: float

    def slack(self, values: Mapping[str, float]) -> float:
        """Distance to the bound relative to |bound| (to 1 for a bound of 0); negative where the bound is violated."""
        return self.sign * (values[self.quantity] - self.bound) / (abs(self.bound) or 1.0)

    @property
    def text(self) -> str:
        """The bound as a user writes it."""
        return f"{self.quantity}{'>=' if self.sign > 0 else '<='}{self.bound:.9g}"


@dataclass(frozen=True)
class TriedDesign:
    """A design that was tried: its variables, and its quantities or the reason why it has none (`failure`)."""

    x: tuple[float, ...]
    values: Mapping[str, float]
    failure: str = ""

    def worst(self, constraints: Sequence[QuantityBound]) -> float:
        """The smallest slack of the constraints; -inf for a design without quantities."""
        if self.failure:
            return -np.inf
        return min((c.slack(self.values) for c in constraints), default=np.inf)

    def meets(self, constraints: Sequence[QuantityBound]) -> bool:
        """Whether every constraint holds."""
        return self.worst(constraints) >= -MET


@dataclass
class OptimisationProblem:
    """Variables, goal and bounds, and every design tried so far (`trials`) by its variables: nothing is computed twice."""

    base: Design
    variables: tuple[DesignVariable, ...]
    goal: OptimisationGoal
    constraints: tuple[QuantityBound, ...]
    measured: QuantitySet
    report: Callable[[int], None] = lambda count: None
    trials: dict[tuple[float, ...], TriedDesign] = field(default_factory=dict)

    def design(self, x: Sequence[float]) -> Design:
        """The design with these variables. Raises MechlabError where it cannot exist."""
        values = {v.name: int(a) if v.whole else float(a) for v, a in zip(self.variables, x, strict=True)}
        return varied(self.base, values)

    def trial(self, x: ArrayLike) -> TriedDesign:
        """The quantities of a design, computed once and kept in `trials`."""
        key = self.inside(x)
        if key not in self.trials:
            try:
                values: Mapping[str, float] = self.measured.numbers(self.design(key))
                self.trials[key] = TriedDesign(key, values)
            except (MechlabError, ArithmeticError, np.linalg.LinAlgError) as cause:
                self.trials[key] = TriedDesign(key, {}, str(cause))
            self.report(len(self.trials))
        return self.trials[key]

    def inside(self, x: ArrayLike) -> tuple[float, ...]:
        """x clipped to the ranges; whole variables rounded."""
        low, high = self.box
        clipped = np.clip(np.asarray(x, dtype=float), low, high)
        return tuple(float(round(a)) if v.whole else float(a) for v, a in zip(self.variables, clipped, strict=True))

    @property
    def box(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the variables, (n,) each."""
        return np.array([v.low for v in self.variables]), np.array([v.high for v in self.variables])

    def best(self, goal: OptimisationGoal, constraints: Sequence[QuantityBound]) -> TriedDesign | None:
        """The best of all trials that meet the constraints within MET; one that meets them exactly where it is as
        good."""
        good = [t for t in self.trials.values() if t.meets(constraints)]
        strict = [t for t in good if t.worst(constraints) >= 0.0]
        first, other = (max(x, key=lambda t: goal.sign * t.values[goal.quantity], default=None) for x in (good, strict))
        if first is None or other is None:
            return first
        gap = abs(first.values[goal.quantity] - other.values[goal.quantity])
        return other if gap <= MET * abs(first.values[goal.quantity]) else first


def variables_of(base: Design, ranges: Mapping[str, Range]) -> tuple[DesignVariable, ...]:
    """Variables from ranges; raises MechlabError for a parameter that cannot vary, and for a range beyond its
    limits."""
    infos = parameter_infos(base)
    out = []
    for name, r in ranges.items():
        info = infos[name]
        if info.kind not in SINGLE_NUMBERS:
            raise MechlabError(
                f"{base.name}: {name} cannot vary: it is of the kind {info.kind!r}, not a single number."
            )
        if r.count is not None:
            raise MechlabError(f"{base.name}: {name} varies continuously: write {name}=low:high, without a count.")
        low, high = (float(coerce(info, end, base.name)) for end in (r.low, r.high))  # type: ignore[arg-type]
        if not low < high:
            raise MechlabError(f"{base.name}: {name}: expected low < high, got {low:g}:{high:g}.")
        out.append(DesignVariable(name, low, high, info.unit, info.kind == "integer"))
    return tuple(out)


def read_goal(text: str, sign: int = 1) -> OptimisationGoal:
    """The goal of the text `QUANTITY`, `max:QUANTITY` or `min:QUANTITY`; a prefix overrides `sign`. Raises
    UsageError."""
    first, colon, rest = text.partition(":")
    if colon and first not in ("max", "min"):
        raise UsageError(f"{text!r}: expected QUANTITY, max:QUANTITY or min:QUANTITY.")
    name = (rest if colon else text).strip()
    if not name:
        raise UsageError("the name of a quantity is missing.")
    return OptimisationGoal(name, {"max": 1, "min": -1}[first] if colon else sign)


def split_constraints(text: str | Sequence[str]) -> list[tuple[str, int, str]]:
    """(quantity, sign, bound as text) of "a>=1,b<=2deg" or a sequence of such. Raises UsageError for anything else."""
    parts = [p for t in ([text] if isinstance(text, str) else text) for p in t.split(",")]
    out = []
    for part in parts:
        found = _CONSTRAINT.fullmatch(part)
        if found is None:
            raise UsageError(f"a constraint is QUANTITY>=value or QUANTITY<=value, got {part!r}.")
        out.append((found[1], 1 if found[2] == ">=" else -1, found[3]))
    return out


def read_constraints(text: str | Sequence[str], units: Mapping[str, str]) -> tuple[QuantityBound, ...]:
    """Constraints with bounds in SI; raises MechlabError for a bound in a wrong unit."""
    out = []
    for name, sign, bound in split_constraints(text):
        if name not in units:
            raise unknown("constraint on the quantity", name, units)
        out.append(QuantityBound(name, sign, parse_number(name, bound, units[name])))
    return tuple(out)


def given_ranges(base: Design, values: Mapping[str, Any]) -> tuple[dict[str, Range], dict[str, Any], dict[str, Any]]:
    """`values` in three parts: ranges of parameters, fixed parameters, and keys that are no parameters."""
    names = parameter_infos(base)
    ranges: dict[str, Range] = {}
    fixed: dict[str, Any] = {}
    rest: dict[str, Any] = {}
    for k, v in values.items():
        if k not in names:
            rest[k] = v
        elif isinstance(v, Range):
            ranges[k] = v
        elif isinstance(v, tuple | list) and len(v) == 2 and names[k].kind in SINGLE_NUMBERS:
            ranges[k] = Range(v[0], v[1])
        else:
            fixed[k] = v
    return ranges, fixed, rest


@dataclass(frozen=True)
class OptimisationTask:
    """A predefined optimisation: variables, goal, constraints (`subject`), fixed values (`given`), second goal
    (`front`).

    text: the task in words; evaluations: number of designs in the search.
    """

    text: str
    variables: Mapping[str, Range]
    goal: OptimisationGoal
    subject: tuple[str, ...] = ()
    given: Mapping[str, float] = field(default_factory=dict)
    front: OptimisationGoal | None = None
    evaluations: int = 600


TASKS: Mapping[str, OptimisationTask] = {
    "delta6": OptimisationTask(
        "the widest disc about the axis in which no cardan bends more than 45 deg and the dexterity stays at 0.3, with guides "
        "that stand no farther out than the source's",
        variables={"rod_length": Range(0.25, 0.6), "radial_offset": Range(0.1, 0.228)},
        goal=OptimisationGoal("reach", 1),
        subject=("dexterity>=0.3", "reach>=0"),
        given={"bend_limit": math.pi / 4},
        front=OptimisationGoal("dexterity", 1),
        evaluations=600,
    ),
    "gear_linkage": OptimisationTask(
        "the longest stop of the output that a play of 2 deg allows (the gears only push, friction holds), with at least one "
        "turn of the output for a turn of the crank and a transmission angle of at least 30 deg",
        variables={
            "crank": Range(0.2, 0.8), "coupler": Range(0.7, 1.3), "rocker": Range(0.7, 1.3), "idler_radius": Range(0.2, 0.6),
        },
        goal=OptimisationGoal("dwell_angle_one_sided", 1),
        subject=("reverse_angle<=2deg", "least_transmission_angle>=30deg", "mean_rate>=1", "dwell_angle_one_sided>=30deg"),
        front=OptimisationGoal("least_transmission_angle", 1),
        evaluations=1500,
    ),
    "fourbar": OptimisationTask(
        "the coupler that keeps the transmission angle farthest from 0 and 180 deg over a turn of the crank",
        variables={"coupler": Range(0.16, 0.4)},
        goal=OptimisationGoal("cycle.least.pin_transmission_angle", 1),
        evaluations=40,
    ),
}  # fmt: skip
