"""Speeds of all members from two of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations
from typing import Any

from mechlab.analytic import planetary_stage as closed_form
from mechlab.catalog.planetary_stage.build import build
from mechlab.catalog.planetary_stage.parameters import Parameters
from mechlab.experiment.question import Answer
from mechlab.kit.epicyclic import engine_speeds, speed_question

SPEEDS = ("sun_rate", "ring_rate", "carrier_rate")


def _analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    known = {k.removesuffix("_rate"): given[k] for k in SPEEDS if k in given}
    found = closed_form.speeds(p.teeth[0], p.teeth[2], planet_teeth=p.teeth[1], **known)
    values = {f"{n}_rate": getattr(found, n) for n in ("sun", "ring", "carrier", "planet")}
    return Answer({k: v for k, v in values.items() if k not in given})


def _engine(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    """A model with a free ring: the speeds of a held one are a special case."""
    free = build(replace(p, ring="free"), "parts")
    return engine_speeds(engine, free, given, SPEEDS, {"planet_rate": "planet_1"})


QUESTIONS = tuple(
    speed_question(pair, (*SPEEDS, "planet_rate"), _analytic, _engine) for pair in combinations(SPEEDS, 2)
)
