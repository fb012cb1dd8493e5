"""Tolerances of inputs: by name, or one share of every parameter; and what they make of an answer."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mechlab.errors import MechlabError, unknown
from mechlab.study.sensitivity.inputs import Input


@dataclass(frozen=True)
class Tolerances:
    """Half widths +-t of inputs in SI, by name (a name without [k] means every entry of a list); share: t / |p| of every
    parameter that is not named, 0 for none."""

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
        """From a mapping of half widths, or one number: the share of every parameter."""
        if isinstance(given, Tolerances):
            return given
        if isinstance(given, Mapping):
            return cls(given)
        return cls() if given is None else cls(share=float(given))

    def half_widths(self, inputs: tuple[Input, ...], skipped: Mapping[str, str], owner: str) -> dict[str, float]:
        """Input name -> t > 0. Raises MechlabError for a name that is no input, and for a wrong unit."""
        known = {i.name for i in inputs} | {i.key for i in inputs}
        for name in self.named:
            if name in skipped:
                raise MechlabError(f"{owner}: {name} has no tolerance: it is {skipped[name]}.")
            if name not in known:
                raise unknown(f"{owner}: input", name, known)
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
