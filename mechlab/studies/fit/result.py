"""The result of a fit: values with their confidence intervals, residuals by channel, what is determined, what confirms it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.lab.design import Design
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.results import Shown
from mechlab.studies.fit.identify import Identifiability
from mechlab.studies.fit.starts import FitStarts, ambiguity
from mechlab.studies.fit.table import TIME

ABOVE = 2.0
"""Residual over stated noise from which the model does not reach the measurements."""
SHIFT, SHIFT_SHARE = 1.0, 1e-3
"""A parameter that another engine would move by more standard errors than the first, and by more of its scale than the second, is not
confirmed."""
SIGNIFICANT = 3.5
"""Standard deviations from which a correlation or a mean of residuals is no chance: one in two thousand."""


@dataclass(frozen=True)
class FittedParameter:
    """Value, standard error and interval (low, high) [unit]; NaN where the data do not determine it. shift: what the confirming engine
    would change. at_end: the value lies at an end of its range. start: where the search began."""

    name: str
    unit: str
    value: float
    error: float
    low: float
    high: float
    start: float
    shift: float | None = None
    at_end: bool = False

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "value": self.value, "unit": self.unit, "standard_error": self.error, "interval": [self.low, self.high],
            "start": self.start, "shift": self.shift, "at_end_of_range": self.at_end,
        }  # fmt: skip


@dataclass(frozen=True)
class ChannelResidual:
    """Residuals of a channel: count, rms and mean [unit]; noise: stated, or estimated; correlation of neighbours (lag 1); chance: what
    the correlation and the mean of white residuals would be, in standard deviations."""

    name: str
    unit: str
    count: int
    rms: float
    mean: float
    noise: float
    stated: bool
    correlation: float
    correlation_sigmas: float
    mean_sigmas: float

    @property
    def is_white(self) -> bool:
        """Whether neighbours are uncorrelated, as far as can be seen."""
        return abs(self.correlation_sigmas) <= SIGNIFICANT

    @property
    def is_unbiased(self) -> bool:
        """Whether the mean is zero, as far as can be seen."""
        return abs(self.mean_sigmas) <= SIGNIFICANT

    @property
    def beyond_noise(self) -> bool:
        """Whether the residual is far above the stated noise."""
        return self.stated and self.rms > ABOVE * self.noise

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "unit": self.unit, "count": self.count, "rms": self.rms, "mean": self.mean, "noise": self.noise, "noise_stated": self.stated,
            "neighbour_correlation": self.correlation, "white": self.is_white, "unbiased": self.is_unbiased,
        }  # fmt: skip


def channel_residual(name: str, unit: str, found: Array, rows: Array, noise: float, stated: bool) -> ChannelResidual:
    """Statistics of the residuals found (m,) of a channel that is measured where rows (n,) are True.

    Lag 1: r = sum e_i e_(i+1) / sum e^2 over measured neighbours; of white residuals r sqrt(pairs) has unit variance.
    """
    whole = np.full(len(rows), np.nan)
    whole[rows] = found
    pairs = whole[1:] * whole[:-1]
    near = np.isfinite(pairs)
    mean_square = float(np.mean(found**2)) or 1.0
    correlation = float(np.mean(pairs[near])) / mean_square if near.any() else 0.0
    spread = float(np.std(found)) or 1.0
    return ChannelResidual(
        name, unit, len(found), float(np.sqrt(np.mean(found**2))), float(np.mean(found)), noise, stated, correlation,
        correlation * float(np.sqrt(near.sum())), float(np.mean(found)) / spread * float(np.sqrt(len(found))),
    )  # fmt: skip


@dataclass(frozen=True, repr=False)
class FitResult(Shown):
    """A fit. parameters: in the order asked for; channels; determined: what the data fix; converged: whether the search ended at a
    least square; way: the engine or witness that fitted, confirmed_by the one that confirmed it ("" for none), differences: channel ->
    rms difference of the two in units of the noise; series: column -> measured, predicted (n,); tried: the searches from
    several starts, where there were any."""

    base: Design
    source: str
    scene: str
    parameters: Mapping[str, FittedParameter]
    channels: Mapping[str, ChannelResidual]
    determined: Identifiability
    converged: bool
    factor: float
    degrees: int
    way: str
    confirmed_by: str
    differences: Mapping[str, float]
    runs: int
    first: tuple[str, str, Array]
    series: Mapping[str, tuple[Array, Array]]
    notes: tuple[str, ...] = ()
    files: Mapping[str, Path] = field(default_factory=dict)
    tried: FitStarts | None = None

    def __getitem__(self, name: str) -> FittedParameter:
        return self.parameters[name]

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.base.name

    @property
    def over_time(self) -> bool:
        """Whether the data are a series over time."""
        return self.first[0] == TIME

    @property
    def is_confirmed(self) -> bool:
        """Whether the other engine, where there is one, would change no parameter beyond its error."""
        return not self._apart

    @property
    def _apart(self) -> list[FittedParameter]:
        found = [p for p in self.parameters.values() if p.shift is not None and np.isfinite(p.error)]
        return [p for p in found if abs(p.shift or 0.0) > SHIFT * p.error and abs(p.shift or 0.0) > SHIFT_SHARE * abs(p.value)]

    @property
    def is_doubtful(self) -> bool:
        """Whether the end may be a local least square: a search that did not converge or came to the end of a range, residuals beyond the
        stated noise, correlated or biased."""
        ends = any(p.at_end for p in self.parameters.values())
        return not self.converged or ends or any(c.beyond_noise or not (c.is_white and c.is_unbiased) for c in self.channels.values())

    @property
    def faults(self) -> tuple[str, ...]:
        """Why the values are not to be trusted; empty where they are."""
        out = list(self.determined.sentences)
        if not self.converged:
            out.append("the search did not converge: give narrower ranges or nearer starts")
        if ends := [p.name for p in self.parameters.values() if p.at_end]:
            out.append(f"{', '.join(ends)} at an end of the range: widen it, or leave the parameter out")
        if beyond := [c for c in self.channels.values() if c.beyond_noise]:
            much = ", ".join(f"{c.name} {c.rms / c.noise:.3g} times" for c in beyond)
            out.append(f"the residual is beyond the stated noise ({much}): the model or the start is wrong")
        if self.tried and (others := self.tried.others(not self.determined.all_fixed)):
            out.append(ambiguity(others))
        if self._apart:
            moved = ", ".join(f"{p.name} by {p.shift:+.3g}" for p in self._apart)
            out.append(f"{self.confirmed_by} would move {moved}, more than the standard error of {self.way}")
        return tuple(out)

    @property
    def exit_code(self) -> int:
        """0, or 3 where something is not determined, did not converge, or is not confirmed."""
        return 3 if self.faults else 0

    @property
    def message(self) -> str:
        """The values or what is wrong with them, in one sentence."""
        if self.faults:
            return f"{self.name}: {'; '.join(self.faults)}"
        values = ", ".join(f"{p.name} = {p.value:.6g} +- {p.error:.2g} {p.unit}".rstrip() for p in self.parameters.values())
        return f"{self.name}: {values}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "mechanism": self.name, "data": self.source, "scene": self.scene, "message": self.message,
            "fitted": {n: p.to_dict() for n, p in self.parameters.items()},
            "channels": {n: c.to_dict() for n, c in self.channels.items()},
            "identifiability": self.determined.to_dict(), "converged": self.converged, "variance_factor": self.factor,
            "degrees_of_freedom": self.degrees, "engine": self.way, "confirmed_by": self.confirmed_by or None,
            "difference_in_noise": dict(self.differences), "runs": self.runs, "faults": list(self.faults),
            "starts": None if self.tried is None else self.tried.to_dict(), "notes": list(self.notes),
            "files": {k: str(p) for k, p in self.files.items()},
        }  # fmt: skip
