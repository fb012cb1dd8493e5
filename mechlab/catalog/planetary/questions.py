"""Speeds of all members from one of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechlab.catalog.planetary.build import build
from mechlab.catalog.planetary.parameters import Parameters
from mechlab.experiment.question import Answer
from mechlab.kit.epicyclic import engine_speeds, speed_question

SPEEDS = ("sun_rate", "carrier_rate", "planet_2_rate", "planet_3_rate")


def _analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    carrier = given["carrier_rate"] if "carrier_rate" in given else given["sun_rate"] / float(p.ratio)
    values = {f"{n}_rate": carrier * float(c) for n, c in p.rates.items()} | {"carrier_rate": carrier}
    return Answer({k: v for k, v in values.items() if k not in given})


def _engine(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    planets = {f"planet_{n}_rate": f"planet_{n}_1" for n in (2, 3)}
    return engine_speeds(engine, build(p, "parts"), given, SPEEDS[:2], planets)


QUESTIONS = tuple(speed_question((key,), SPEEDS, _analytic, _engine) for key in SPEEDS[:2])
