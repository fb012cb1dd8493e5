"""The inputs of answers (numeric parameters, entry by entry, and chosen given quantities) and their tolerances."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import field
from typing import Any

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.parameters import ParameterInfo, describe
from mechlab.lab.design import Design
from mechlab.lazy_dataclass import dataclass
from mechlab.studies.named.number import varied

WHY = {
    "integer": "a whole number",
    "integers": "whole numbers",
    "ratio": "a ratio, exact as its teeth",
    "text": "a text",
}


@dataclass(frozen=True)
class AnswerInput:
    """A number that answers depend on. name: the parameter, PARAMETER[k] for an entry of a list, or a given quantity;
    size: scale of the difference steps [unit]; index: entry of the list; given: True for a given quantity."""

    name: str
    key: str
    value: float
    unit: str
    size: float
    index: int | None = None
    given: bool = False

    def moved(self, base: Design, asked: Mapping[str, Any], by: float) -> tuple[Design, dict[str, Any]]:
        """Design and given quantities with this input changed. Raises MechlabError where the design cannot exist."""
        value: Any = self.value + by
        if self.given:
            return base, dict(asked) | {self.key: value}
        if self.index is not None:
            entries = list(getattr(base.parameters, self.key))
            entries[self.index] = value
            value = tuple(entries)
        return varied(base, {self.key: value}), dict(asked)


def inputs_of(
    base: Design, asked: Mapping[str, Any], units: Mapping[str, str], also: Collection[str] = ()
) -> tuple[tuple[AnswerInput, ...], dict[str, str]]:
    """The inputs, and parameter -> reason for parameters that are no inputs. also: given quantities that are inputs
    too."""
    found: list[AnswerInput] = []
    skipped: dict[str, str] = {}
    infos = describe(base.entry.parameters)
    sizes = _sizes(base, infos)
    for info in infos:
        value = getattr(base.parameters, info.name)
        if info.kind not in ("number", "numbers"):
            skipped[info.name] = WHY[info.kind]
        elif value is None:
            skipped[info.name] = "not set"
        elif info.kind == "number":
            x = float(value)
            found.append(AnswerInput(info.name, info.name, x, info.unit, _size(x, info.unit, sizes)))
        else:
            found += [
                AnswerInput(f"{info.name}[{k}]", info.name, float(x), info.unit, _size(float(x), info.unit, sizes), k)
                for k, x in enumerate(value)
            ]
    for key in also:
        unit, x = units.get(key, ""), float(asked[key])
        found.append(AnswerInput(key, key, x, unit, _size(x, unit, sizes), given=True))
    return tuple(found), skipped


def check_names(
    names: Iterable[str], inputs: Collection[AnswerInput], skipped: Mapping[str, str], owner: str, lacks: str
) -> None:
    """Raises MechlabError for a name that is no input: why a parameter has none of what it `lacks`, or what exists."""
    known = {i.name for i in inputs} | {i.key for i in inputs}
    for name in names:
        if name in skipped:
            raise MechlabError(f"{owner}: {name} has no {lacks}: it is {skipped[name]}.")
        if name not in known:
            raise unknown(f"{owner}: input", name, known)


def _sizes(base: Design, infos: tuple[ParameterInfo, ...]) -> dict[str, float]:
    """Unit -> largest |value| of a parameter: the scale of steps for an input near zero."""
    out: dict[str, float] = {}
    for info in infos:
        value = getattr(base.parameters, info.name)
        many = value if info.kind == "numbers" else (value,)
        if info.kind in ("number", "numbers") and value is not None:
            out[info.unit] = max(out.get(info.unit, 0.0), *(abs(float(x)) for x in many))
    return out


def _size(value: float, unit: str, sizes: Mapping[str, float]) -> float:
    """Scale of an input: 1 for angles; else |value|, or for a value near zero the largest parameter of its unit."""
    like = 1.0 if unit == "rad" else sizes.get(unit, 0.0) or 1.0
    return like if unit == "rad" or abs(value) < 1e-3 * like else abs(value)


@dataclass(frozen=True)
class Tolerances:
    """Half widths t of inputs p +- t in SI, by name (a name without [k] means every entry of a list); share: t / |p| of
    every parameter that is not named, 0 for none."""

    named: Mapping[str, Any] = field(default_factory=dict)
    share: float = 0.0

    def __post_init__(self) -> None:
        for name, t in {**self.named, "share": self.share}.items():
            if isinstance(t, str) or not (isinstance(t, int | float) or hasattr(t, "__float__")):
                raise MechlabError(f"tolerance of {name}: expected a number, got {t!r}.")
            if not (math.isfinite(float(t)) and float(t) >= 0.0):
                raise MechlabError(f"tolerance of {name}: expected a finite number of at least 0, got {t!r}.")

    @classmethod
    def of(cls, given: Tolerances | Mapping[str, Any] | float | None) -> Tolerances:
        """Tolerances from a mapping of half widths, or from one number, the share of every parameter; None: no
        tolerances."""
        if isinstance(given, Tolerances):
            return given
        if isinstance(given, Mapping):
            return cls(given)
        return cls() if given is None else cls(share=float(given))

    def half_widths(self, inputs: tuple[AnswerInput, ...], skipped: Mapping[str, str], owner: str) -> dict[str, float]:
        """Input name -> t > 0. Raises MechlabError for a name that is no input, and for a wrong unit."""
        check_names(self.named, inputs, skipped, owner, "tolerance")
        out: dict[str, float] = {}
        for i in inputs:
            t = self.named.get(i.name, self.named.get(i.key))
            if t is None:
                width = 0.0 if i.given else self.share * abs(i.value)
            else:
                written = getattr(t, "unit", i.unit)
                if i.unit and written != i.unit:
                    raise MechlabError(f"{owner}: tolerance of {i.name}: expected [{i.unit}], got [{written}].")
                width = float(t)
            if width > 0.0:
                out[i.name] = width
        return out
