"""Numbers of a design by name, for all studies: its parameters, and the answer of one witness to a question."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechlab.experiment.parameters import ParameterInfo, describe
from mechlab.experiment.question import Answer, Question
from mechlab.lab.design import Design

SINGLE_NUMBERS = ("number", "integer", "ratio")
"""Kinds of parameters that are a single number, which a study can vary."""


def parameter_infos(design: Design) -> dict[str, ParameterInfo]:
    """Parameter -> its unit, kind and text."""
    return {i.name: i for i in describe(design.entry.parameters)}


def parameter_values(design: Design) -> dict[str, Any]:
    """Parameter -> its value in the design."""
    return {name: getattr(design.parameters, name) for name in parameter_infos(design)}


def keys_to_give(design: Design) -> set[str]:
    """Keys that a user can give: parameters, keys of questions, axes and limits of the workspace."""
    recipe = design.entry.workspace
    keys = {k for q in design.entry.questions for k in (*q.given, *q.optional)} | {*parameter_infos(design)}
    return keys | ({*recipe.grid, *recipe.limits} if recipe else set())


def witness_answer(question: Question, design: Design, given: Mapping[str, Any], witness: str = "") -> Answer:
    """The answer of one witness (default: the first); keys that are not given take the defaults of the question."""
    defaults = {k: v for k, v in question.optional.items() if v is not None}
    function = question.witnesses[witness] if witness else next(iter(question.witnesses.values()))
    return function(design.parameters, defaults | dict(given))
