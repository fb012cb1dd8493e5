"""The unknowns of a fit: parameters that are numbers, entries of lists, and initial values of a scene."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.parameters import ParameterInfo, describe, mechanism_units
from mechlab.lab.design import Design, initial_keys
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.studies.named.number import varied
from mechlab.studies.sensitivity.inputs import WHY
from mechlab.values import Range, in_unit

SMALL = 1e-3
"""A start below this share of the largest parameter of its unit counts as zero: its scale is that parameter."""
FITTED = ("number", "numbers", "ratio")
"""Kinds of parameters that can be fitted."""


@dataclass(frozen=True)
class FitUnknown:
    """An unknown: start, bounds low and high (infinite where there are none), scale of its steps [unit]; index: entry of a list;
    initial: an initial value X_0 or X_rate_0 instead of a parameter. relative: whether the scale is the start itself."""

    name: str
    key: str
    unit: str
    start: float
    low: float
    high: float
    scale: float
    index: int | None = None
    initial: bool = False

    @property
    def relative(self) -> bool:
        """Whether changes of it are counted relative to its value."""
        return self.unit != "rad" and not self.initial


def unknowns_of(base: Design, ranges: Mapping[str, Range], free: Sequence[str], scene: str | None, timed: bool) -> tuple[FitUnknown, ...]:
    """The unknowns that `ranges` and `free` name, in that order.

    base: with the parameters of the scene. timed: data over time, in which initial values exist. Raises MechlabError for what is no
    unknown, naming what exists, and for a range without its unit or width.
    """
    names = list(dict.fromkeys([*ranges, *free]))
    if not names:
        raise MechlabError(
            f"{base.name}: say what is unknown: a range, key=low:high, or `free` with names. "
            f"Parameters: {', '.join(i.name for i in describe(base.entry.parameters) if i.kind in FITTED)}."
        )
    infos = {i.name: i for i in describe(base.entry.parameters)}
    mechanism = base.moving(base.scene(scene)) if timed else None
    initial = {k for k in initial_keys(mechanism) if not k.endswith("_force")} if mechanism is not None else set()
    found: list[FitUnknown] = []
    for name in names:
        span = ranges.get(name)
        key, _, entry = name.partition("[")
        if key in infos:
            found += _of_parameter(base, infos[key], name, entry.removesuffix("]"), span)
        elif name in initial and mechanism is not None:
            found.append(_of_start(base, name, span, scene, mechanism))
        else:
            raise unknown(f"{base.name}: unknown", name, {i.name for i in infos.values() if i.kind in FITTED} | initial)
    return tuple(found)


def _of_parameter(base: Design, info: ParameterInfo, name: str, entry: str, span: Range | None) -> list[FitUnknown]:
    value = getattr(base.parameters, info.name)
    if info.kind not in FITTED:
        raise MechlabError(f"{base.name}: {name} cannot be fitted: it is {WHY.get(info.kind, info.kind)}.")
    if value is None and span is None:
        raise MechlabError(f"{base.name}: {name} is not set; give a range, {name}=low:high.")
    several = value if info.kind == "numbers" else (value,)
    picked = range(len(several)) if info.kind == "numbers" and not entry else [int(entry) if entry.isdigit() else 0]
    if entry and (info.kind != "numbers" or not entry.isdigit() or int(entry) >= len(several)):
        entries = ", ".join(f"{info.name}[{k}]" for k in range(len(several))) if info.kind == "numbers" else info.name
        raise MechlabError(f"{base.name}: {name} does not exist; existing: {entries}.")
    out = []
    for k in picked:
        index = k if info.kind == "numbers" else None
        label = info.name if index is None else f"{info.name}[{index}]"
        like = _largest(base, info.unit)
        start, low, high = _bounds(base.name, label, info.unit, span, None if value is None else float(several[k]))
        low, high = max(low, _limit(info.low, -np.inf)), min(high, _limit(info.high, np.inf))
        if not low < high:
            raise MechlabError(f"{base.name}: {label}: the range leaves nothing within its limits, {info.range_text}.")
        scale = 1.0 if info.unit == "rad" else (abs(start) if abs(start) > SMALL * like else like)
        out.append(FitUnknown(label, info.name, info.unit, float(np.clip(start, low, high)), low, high, scale, index))
    return out


def _of_start(base: Design, name: str, span: Range | None, scene: str | None, mechanism: Mechanism) -> FitUnknown:
    made, unit = base.scene(scene), mechanism_units(mechanism)[name][0]
    rate = name.endswith("_rate_0")
    of = name.removesuffix("_rate_0" if rate else "_0")
    start = dict(made.initial_rates if rate else made.initial).get(of)
    if start is None and span is None and not rate:
        q = dict(zip(mechanism.scalar_names, mechanism.reference(), strict=False))
        start = q.get(of)
    value, low, high = _bounds(base.name, name, unit, span, 0.0 if start is None and rate else start)
    scale = 1.0 if unit == "rad" else max(abs(value), mechanism.length_scale if unit == "m" else 1.0)
    return FitUnknown(name, name, unit, value, low, high, scale, initial=True)


def _bounds(owner: str, name: str, unit: str, span: Range | None, value: float | None) -> tuple[float, float, float]:
    """Start, low, high: the value where it lies in the range, else the middle."""
    if span is None:
        if value is None:
            raise MechlabError(f"{owner}: {name} has no start in this scene; give a range, {name}=low:high.")
        return value, -np.inf, np.inf
    in_unit(f"{owner}: {name}", span, unit)
    low, high = float(span.low), float(span.high)
    if not low < high:
        raise MechlabError(f"{owner}: {name}: expected low < high, got {span}.")
    return (value if value is not None and low <= value <= high else 0.5 * (low + high)), low, high


def _limit(limit: float | None, none: float) -> float:
    return none if limit is None else limit


def _largest(base: Design, unit: str) -> float:
    """Largest size of a parameter of that unit; 1 where all are zero."""
    out = 0.0
    for info in describe(base.entry.parameters):
        value = getattr(base.parameters, info.name)
        if info.unit == unit and info.kind in FITTED and value is not None:
            out = max(out, *(abs(float(x)) for x in (value if info.kind == "numbers" else (value,))))
    return out or 1.0


def applied(base: Design, unknowns: Collection[FitUnknown], x: Array) -> tuple[Design, dict[str, float]]:
    """The design with the values x, and its initial values. Raises MechlabError where it cannot exist."""
    changes: dict[str, Any] = {}
    extra = {}
    for item, value in zip(unknowns, x.tolist(), strict=True):
        if item.initial:
            extra[item.key] = value
        elif item.index is None:
            changes[item.key] = value
        else:
            entries = list(changes.get(item.key, getattr(base.parameters, item.key)))
            entries[item.index] = value
            changes[item.key] = tuple(entries)
    return varied(base, changes), extra
