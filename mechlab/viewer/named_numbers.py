"""Which numbers of the model document follow which named parameter of a definition, found by building it a few times.

The page inverts this: an edited length that is a parameter becomes the key=value that reproduces it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.parameters import describe
from mechlab.formats.mechanism_json import to_json
from mechlab.lab.design import Design, design
from mechlab.lazy_dataclass import dataclass

LARGEST, MOST = 10_000, 150_000
"""Numbers of a document that is probed at most (the six-freedom delta has 2,335), and of all documents that are built for it."""
STEP = 0.01
"""Share of a parameter by which it is moved either way."""
STRAIGHT = 1e-7
"""Largest second difference of a number that depends affinely, relative to its change."""


@dataclass(frozen=True)
class NamedParameter:
    """A parameter `key` in `unit` with its `value`, and slopes: path of a number in the document -> its change per unit."""

    key: str
    unit: str
    value: float
    slopes: Mapping[str, float]


@dataclass(frozen=True)
class NamedNumbers:
    """What reproduces an edit: `name` of the mechanism as the verbs take it, values `given` as text, and the parameters."""

    name: str
    given: tuple[str, ...]
    parameters: tuple[NamedParameter, ...]


def flat(document: Any, path: str = "") -> dict[str, float]:
    """Path -> number of a model document; keys and indices are joined by "/"."""
    if isinstance(document, bool) or document is None or isinstance(document, str):
        return {}
    if isinstance(document, int | float):
        return {path: float(document)}
    items = document.items() if isinstance(document, dict) else enumerate(document)
    found: dict[str, float] = {}
    for key, value in items:
        found |= flat(value, f"{path}/{key}" if path else str(key))
    return found


def named_numbers(d: Design) -> NamedNumbers | None:
    """Two builds a parameter, in its richest fidelity; None for a definition without parameters that are numbers, or a large one."""
    base = numbers_of(d)
    if base is None or len(base) > LARGEST:
        return None
    found, built = [], 0
    for item in describe(d.entry.parameters):
        value = getattr(d.parameters, item.name)
        if item.kind != "number" or not isinstance(value, float | int) or not np.isfinite(value):
            continue
        built += 2 * len(base)
        if built > MOST:
            break
        step = STEP * abs(float(value)) or STEP
        low, high = (numbers_of(d, {item.name: float(value) + way * step}) for way in (-1.0, 1.0))
        slopes = _slopes(base, low, high, step)
        if slopes:
            found.append(NamedParameter(item.name, item.unit, float(value), slopes))
    given = tuple(f"{k}={v}" for k, v in d.given.items() if isinstance(v, int | float | str))
    return NamedNumbers(d.entry.name, given, tuple(found)) if found else None


def numbers_of(d: Design, changed: Mapping[str, float] | None = None) -> dict[str, float] | None:
    """The numbers of the document of a design in its richest fidelity, or of one with other parameters; None where it cannot be built."""
    try:
        other = design(d.entry, {**d.given, **changed}) if changed else d
        return flat(json.loads(to_json(other.mechanism(list(other.entry.fidelities)[-1]))))
    except MechlabError:
        return None


def _slopes(
    base: Mapping[str, float], low: Mapping[str, float] | None, high: Mapping[str, float] | None, step: float
) -> dict[str, float]:
    """Slopes of the numbers that depend affinely; empty where the documents have other parts."""
    if low is None or high is None or base.keys() != low.keys() or base.keys() != high.keys():
        return {}
    slopes = {}
    for path, x in base.items():
        change, bend = high[path] - low[path], high[path] + low[path] - 2.0 * x
        size = max(abs(x), abs(change))
        if abs(change) > 1e-12 * size and abs(change) > 1e-15 and abs(bend) < STRAIGHT * abs(change) + 4e-16 * size:
            slopes[path] = float(f"{change / (2.0 * step):.10g}")
    return slopes
