"""A named number as data, the reductions of a series to one number, and the parameters and keys of a design."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.parameters import ParameterInfo, describe
from mechlab.lab.design import Design, design
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

SINGLE_NUMBERS = ("number", "integer", "ratio")
"""Kinds of parameters that are a single number, which a study can vary."""
OF_TIME = ("final", "max", "min", "mean", "rms")
"""Reductions of a channel in `HOW(CHANNEL)`."""
OF_COURSE = ("least", "largest", "peak", "mean", "span", "final")
"""Reductions in `cycle.HOW.COLUMN` and `run.HOW.CHANNEL`."""
OF_CHECK = ("difference", "passed")
"""Numbers of a check: `difference(ID)`, `passed(ID)`."""


@dataclass(frozen=True)
class NamedNumber:
    """A number of a design, read from its text once.

    label: the name as the user writes it, by which results list it. kind, what it is read from: "parameter", "answer",
    "workspace", "cycle"; of a run: "channel", "finding" (of the health record), "trusted"; of a check: "difference",
    "passed". name: of the parameter, answer, column, channel, finding or check. reduce: how a series becomes one number,
    of OF_TIME or OF_COURSE.
    """

    label: str
    kind: str
    name: str
    reduce: str = "final"
    unit: str = ""

    @property
    def of_run(self) -> bool:
        """True when it needs a simulation."""
        return self.kind in ("channel", "finding", "trusted")

    @property
    def of_check(self) -> bool:
        """True when it needs a check."""
        return self.kind in OF_CHECK


def reduced(how: str, t: Array, values: Array) -> float:
    """One number of samples (n,) at times or positions t (n,).

    final: the last; max or largest, min or least; peak: the largest size; span: largest less least; mean and rms: over
    t, by the trapezoidal rule. Raises MechlabError for a mean or rms of samples at a single time.
    """
    x = np.asarray(values, dtype=float)
    if how == "final":
        return float(x[-1])
    if how in ("max", "largest"):
        return float(np.max(x))
    if how in ("min", "least"):
        return float(np.min(x))
    if how == "peak":
        return float(np.max(np.abs(x)))
    if how == "span":
        return float(np.ptp(x))
    length = float(t[-1] - t[0])
    if not length > 0.0:
        raise MechlabError(f"a {how} over time needs a run that lasts.")
    if how == "mean":
        return float(np.trapezoid(x, t)) / length
    return float(np.sqrt(np.trapezoid(x * x, t) / length))


def reduced_finite(how: str, t: Array, values: Array) -> float:
    """As `reduced`, over the finite samples alone. Raises MechlabError where there is none."""
    x = np.asarray(values, dtype=float)
    finite = np.isfinite(x)
    if not finite.any():
        raise MechlabError("no finite value in the column.")
    return reduced(how, np.asarray(t, dtype=float)[finite], x[finite])


def parameter_infos(design: Design) -> dict[str, ParameterInfo]:
    """Parameter -> its unit, kind and text."""
    return {i.name: i for i in describe(design.entry.parameters)}


def parameter_values(design: Design) -> dict[str, Any]:
    """Parameter -> its value in the design."""
    return {name: getattr(design.parameters, name) for name in parameter_infos(design)}


def varied(base: Design, changes: Mapping[str, Any]) -> Design:
    """The design with changed parameters. Raises MechlabError where it cannot exist."""
    return design(base.entry, dict(base.given) | dict(changes)) if changes else base


def keys_to_give(design: Design) -> set[str]:
    """Keys that a user can give: parameters, keys of questions, axes and limits of the workspace."""
    recipe = design.entry.workspace
    keys = {k for q in design.entry.questions for k in (*q.given, *q.optional)} | {*parameter_infos(design)}
    return keys | ({*recipe.grid, *recipe.limits} if recipe else set())
