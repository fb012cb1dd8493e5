"""What the claims and checks ask of every witness: the example with both tooth sets, states, short runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.catalog.closed_differential import questions, reference, scenes
from mechlab.catalog.closed_differential.build import build
from mechlab.catalog.closed_differential.parameters import STATED_TEETH, USED_TEETH, Parameters
from mechlab.catalog.closed_differential.witnesses import ENGINES, Machine, machine, numpy_machine
from mechlab.experiment.question import Answer
from mechlab.experiment.recording import Recording
from mechlab.kit.witness import room
from mechlab.mechanism.geometry import Array

LAB = Parameters()
EXAMPLE = {"used teeth": replace(LAB, teeth=USED_TEETH), "stated teeth": replace(LAB, teeth=STATED_TEETH)}
"""The source's numeric example, with the teeth that its computation uses and with those that it states."""
FIDELITY = {"pinocchio": "parts", "mujoco": "minimal"}
"""Fidelity in which an engine is asked to run: Pinocchio with the gear rows, MuJoCo without soft rows."""


def answers(p: Parameters, **given: float) -> dict[str, dict[str, Any]]:
    """Witness -> values of the question."""
    said: dict[str, Answer] = {"analytic": questions.analytic(p, given)}
    said |= {engine: questions.by_engine(engine, p, given) for engine in ENGINES}
    return {name: answer.values for name, answer in said.items() if not answer.cannot}


def machines(p: Parameters, fidelity: str = "parts") -> dict[str, Machine]:
    """Witness -> its mass matrix and gear rows; the numpy tree stands for the closed form."""
    return {"numpy": numpy_machine(p, fidelity)} | {engine: machine(engine, p, fidelity) for engine in ENGINES}


def run(who: str, p: Parameters, scene: str, duration: float | None = None, fidelity: str | None = None) -> Recording:
    """A run of a scene with the parameters as they are, by "analytic" or an engine."""
    level = fidelity or FIDELITY.get(who, "minimal")
    made = scenes.SCENES[scene].make(p, level)
    made = replace(made, duration=duration or made.duration)
    if who == "analytic":
        return reference.reference(p, made)
    settings = replace(made.settings, engine=who, integrator="RK4")
    found: Recording = room(who).run(build(p, level), made, settings)
    return found


def runs(p: Parameters, scene: str, duration: float | None = None) -> dict[str, Recording]:
    """Witness -> run."""
    return {who: run(who, p, scene, duration) for who in ("analytic", *ENGINES)}


def speeds(recording: Recording) -> tuple[float, float]:
    """Final w_H1, w_H2."""
    return float(recording.channel("H1_rate")[-1]), float(recording.channel("H2_rate")[-1])


def outer_power(p: Parameters, recording: Recording) -> Array:
    """(n,) M_H1 w_H1 - M_H2 w_H2 [W] along a run."""
    return p.M_H1 * recording.channel("H1_rate") - p.M_H2 * recording.channel("H2_rate")


def rounded(values: Any, digits: int = 10) -> Any:
    """Numbers as plain lists, rounded, without negative zeros."""
    return (np.round(np.asarray(values, dtype=float), digits) + 0.0).tolist()


def by_witness(function: Callable[[str], Any], what: str) -> dict[str, Any]:
    """{"witness: what": value} for the closed form and both engines."""
    return {f"{who}: {what}": function(who) for who in ("analytic", *ENGINES)}


__all__ = [
    "EXAMPLE", "LAB", "answers", "by_witness", "machines", "outer_power", "rounded", "run", "runs", "speeds",
]  # fmt: skip
