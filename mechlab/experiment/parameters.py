"""Parameters of a mechanism, and the SI units of all keys, by which a value such as `37deg` is checked.

Parameters are the fields of a flat frozen dataclass; each carries unit, meaning, limits and source. Keys of a joint or
shaft X: X and X_0 [rad or m], X_rate and X_rate_0, X_accel, X_force [N m or N]. Keys of a frame F: F_x [m], F_x_rate,
F_x_accel, F_wx [rad/s], F_wx_rate. Keys of a question: its own `units`, completed by the same suffixes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, Field, field, fields, is_dataclass, replace
from fractions import Fraction
from functools import cache, lru_cache
from typing import Any, TypeVar, get_type_hints

from mechlab.errors import MechlabError, explained, unknown
from mechlab.experiment.entry import Entry
from mechlab.experiment.question import Question
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import as_fraction
from mechlab.values import LARGEST_NUMBER, has_unit, in_unit, parse_value

T = TypeVar("T")
KINDS: dict[object, str] = {float: "number", int: "integer", Fraction: "ratio", str: "text"}


@dataclass(frozen=True)
class ParameterInfo:
    """One parameter as it is shown to a user. kind: "number", "integer", "ratio", "text", "numbers" or "integers" (lists). any_unit: its
    unit is not known, so a number with any unit is taken, in SI."""

    name: str
    kind: str
    default: object
    unit: str
    text: str
    source: str
    low: float | None
    high: float | None
    strict: bool
    length: int | None
    optional: bool
    any_unit: bool = False

    @property
    def range_text(self) -> str:
        """The limits in words."""
        low = "" if self.low is None else f"{'>' if self.strict else '>='} {self.low:g}"
        high = "" if self.high is None else f"<= {self.high:g}"
        return ", ".join(x for x in (low, high) if x)


@explained
def parameter(
    default: T,
    unit: str,
    text: str,
    *,
    source: str = "",
    low: float | None = None,
    high: float | None = None,
    strict: bool = False,
    scene: bool = False,
) -> T:
    """A dataclass field, or the default of an argument of a function, with unit, meaning, source and limits; `strict` excludes the
    value `low` itself; `scene`: only scenes use it, so that all its values share one mechanism."""
    meta = {"unit": unit, "text": text, "source": source, "low": low, "high": high, "strict": strict, "scene": scene}
    return field(default=default, metadata=meta)


def of_mechanism(parameters: Any) -> Any:
    """The parameters with those at their defaults that only scenes use."""
    cls: Any = type(parameters)
    of_scenes = scene_defaults(cls)
    return replace(parameters, **of_scenes) if of_scenes else parameters


@cache
def scene_defaults(cls: Any) -> dict[str, Any]:
    """Default values of those parameters that only scenes use."""
    return {f.name: f.default for f in (fields(cls) if is_dataclass(cls) else ()) if f.metadata.get("scene")}


def describe(cls: type[Any]) -> tuple[ParameterInfo, ...]:
    """The parameters of a parameter class, in order."""
    known: Any = cls
    return _described(known)


@lru_cache(maxsize=256)
def _described(cls: Any) -> tuple[ParameterInfo, ...]:
    hints = get_type_hints(cls)
    return tuple(_info(f, hints[f.name]) for f in fields(cls))


def _info(f: Field[Any], hint: Any) -> ParameterInfo:
    text = str(hint)
    optional = "None" in text
    if "tuple" in text:
        kind = "integers" if "int" in text else "numbers"
    elif "Fraction" in text:
        kind = "ratio"
    else:
        kind = next((name for t, name in KINDS.items() if getattr(t, "__name__", "") in text), "number")
    default = None if f.default is MISSING else f.default
    length = len(default) if isinstance(default, tuple) else None
    meta = f.metadata
    return ParameterInfo(
        f.name, kind, default, meta.get("unit", ""), meta.get("text", ""), meta.get("source", ""),
        meta.get("low"), meta.get("high"), meta.get("strict", False), length, optional,
        meta.get("any_unit", False),
    )  # fmt: skip


def make(cls: type[Any], values: Mapping[str, object], owner: str = "") -> Any:
    """An instance of a parameter class from values, each converted by `coerce`.

    Raises MechlabError for an unknown name (listing those that exist), a wrong type, length, or value out of range.
    """
    infos = {i.name: i for i in describe(cls)}
    given: dict[str, object] = {}
    for name, value in values.items():
        if name not in infos:
            raise unknown(f"{owner or cls.__name__}: parameter", name, infos)
        given[name] = coerce(infos[name], value, owner)
    return cls(**given)


def coerce(info: ParameterInfo, value: object, owner: str = "") -> object:
    """`value` converted to the type of the parameter and checked against its limits; raises MechlabError."""
    what = f"{owner}: parameter {info.name!r}" if owner else f"parameter {info.name!r}"
    if info.optional and (value is None or value == "none"):
        return None
    if info.kind in ("numbers", "integers"):
        items = list(value) if isinstance(value, Iterable) and not isinstance(value, str) else [value]
        if info.length is not None and len(items) != info.length:
            raise MechlabError(f"{what}: expected {info.length} values, got {len(items)}.")
        return tuple(_scalar("integer" if info.kind == "integers" else "number", x, what, info) for x in items)
    return _scalar(info.kind, value, what, info)


def _scalar(kind: str, value: object, what: str, info: ParameterInfo) -> object:
    if kind == "text":
        return str(value)
    if isinstance(value, str):
        value = parse_value(what, value)
    written = getattr(value, "unit", None)
    if written is not None and written != info.unit and not info.any_unit:
        wanted = f"[{info.unit}]" if info.unit else "without a unit"
        raise MechlabError(f"{what}: expected a number {wanted}, got {getattr(value, 'written', written)}.")
    if kind == "ratio":
        number: float | Fraction | int = as_fraction(value, what)
    else:
        try:
            number = float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            unit = f" [{info.unit}]" if info.unit else ""
            raise MechlabError(f"{what}: expected a number{unit}, got {value!r}.") from None
        if not math.isfinite(number):
            raise MechlabError(f"{what}: expected a finite number, got {value!r}.")
        if abs(number) > LARGEST_NUMBER:
            raise MechlabError(
                f"{what}: a number beyond {LARGEST_NUMBER:g}, got {number:g}: its powers leave the range of doubles."
            )
        if kind == "integer":
            if number != int(number):
                raise MechlabError(f"{what}: expected an integer, got {value!r}.")
            number = int(number)
    low, high = info.low, info.high
    unit = f" {info.unit}" if info.unit else ""
    if low is not None and (number < low or (info.strict and number == low)):
        raise MechlabError(f"{what}: must be {'>' if info.strict else '>='} {low:g}{unit}, got {float(number):g}.")
    if high is not None and number > high:
        raise MechlabError(f"{what}: must be <= {high:g}{unit}, got {float(number):g}.")
    return number


FORCES = {"m": "N", "rad": "N m"}
Units = dict[str, tuple[str, ...]]
"""Key -> the SI units that are allowed for it; several where the mechanism does not determine one."""


def mechanism_units(m: Mechanism) -> Units:
    """Units of all keys of joints, shafts and frames. A shaft over slides may be an angle or a length: both fit."""
    out: Units = {}
    shafts = {s.name: {n for n, _ in s.coefficients} for s in m.shafts}
    for name in m.scalar_names:
        bases: tuple[str, ...] = ("m",) if name in m.slides else ("rad",)
        if shafts.get(name, set()) & m.slides:
            bases = ("rad", "m")
        out |= dict.fromkeys((name, f"{name}_0"), bases)
        out |= {key: tuple(f"{b}/s" for b in bases) for key in (f"{name}_rate", f"{name}_rate_0")}
        out[f"{name}_accel"] = tuple(f"{b}/s2" for b in bases)
        out[f"{name}_force"] = tuple(FORCES[b] for b in bases)
    for frame in m.frames:
        for a in "xyz":
            key = f"{frame.name}_{a}"
            out |= {key: ("m",), f"{key}_rate": ("m/s",), f"{key}_accel": ("m/s2",)}
            key = f"{frame.name}_w{a}"
            out |= {key: ("rad/s",), f"{key}_rate": ("rad/s2",)}
    return out


def question_units(question: Question) -> Units:
    """Units of the keys of a question: as declared, rad for angles, or derived from the key X for X_rate and
    X_accel."""
    known = dict.fromkeys(question.angles, "rad") | dict(question.units)
    keys = (*question.given, *question.optional, *question.answers)
    for key in keys:
        for suffix, per in (("_rate", "/s"), ("_accel", "/s2")):
            base = key.removesuffix(suffix)
            stem = base if base in known else f"{base}_angle"
            if key not in known and key != base and stem in known:
                known[key] = known[stem] + per
    return {k: (known[k],) for k in keys if k in known}


def entry_units(entry: Entry, mechanisms: Iterable[Mechanism] = ()) -> Units:
    """Units of all keys that are no parameters: those of the workspace, of `mechanisms`, and of the questions."""
    out: Units = {}
    for m in mechanisms:
        for key, units in mechanism_units(m).items():
            out[key] = tuple(dict.fromkeys((*out.get(key, ()), *units)))
    if entry.workspace is not None:
        out |= {k: (u,) for k, u in entry.workspace.units.items()}
        out |= {k: (limit.unit,) for k, limit in entry.workspace.limits.items()}
    for question in entry.questions:
        out |= question_units(question)
    return out


def checked(values: Mapping[str, Any], units: Units) -> dict[str, Any]:
    """The values, with texts parsed to numbers; raises MechlabError for a value whose unit does not fit its key."""
    return {
        k: in_unit(k, v, *units[k]) if k in units and (has_unit(v) or isinstance(v, str)) else v
        for k, v in values.items()
    }
