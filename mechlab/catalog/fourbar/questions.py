"""The question of the four-bar: the same from the closed form and from the engines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.analytic import fourbar as closed_form
from mechlab.catalog.fourbar.build import build
from mechlab.catalog.fourbar.parameters import Parameters
from mechlab.experiment.question import Answer, Question, with_rates
from mechlab.kit.witness import engine_answer
from mechlab.mechanism import Status
from mechlab.tables import up_to

ANGLES = ("coupler_angle", "rocker_angle")


def _named(values: dict[str, Any]) -> dict[str, Any]:
    """Both spellings of a rate: coupler_rate and coupler_angle_rate."""
    short = {k.replace("_angle_", "_"): v for k, v in values.items() if "_angle_" in k}
    return values | short


def _analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    found = closed_form.solve(*p.lengths, given["crank_angle"], given["crank_rate"], given["crank_accel"], mode=p.mode)
    if not np.all(found.assembles):
        gap = float(np.max(np.where(found.assembles, 0.0, found.gap)))
        text = f"the bars are {up_to(found.gap)}{gap:.6g} m short of meeting"
        return Answer(status=Status.NO_ASSEMBLY, notes=(text,), details={"gap": gap}, solved=found.assembles)
    values: dict[str, Any] = {}
    for bar in ("coupler", "rocker"):
        values[f"{bar}_angle"] = getattr(found, f"{bar}_angle")
        values[f"{bar}_angle_rate"] = getattr(found, f"{bar}_rate")
        values[f"{bar}_angle_accel"] = getattr(found, f"{bar}_accel")
    status = Status.SOLVED if np.all(found.regular) else Status.BOUNDARY
    return Answer(_named(values | {"transmission_angle": found.transmission_angle}), status)


def _engine(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    names = [f"{a}{s}" for a in ANGLES for s in ("", "_rate", "_accel")]
    asked = {
        "crank_angle": given["crank_angle"],
        "crank_angle_rate": given["crank_rate"],
        "crank_angle_accel": given["crank_accel"],
    }
    answer = engine_answer(engine, build(p, "minimal"), asked, names)
    return Answer(_named(answer.values), answer.status, answer.notes, cannot=answer.cannot)


def _pinocchio(p: Parameters, given: Mapping[str, Any]) -> Answer:
    return _engine("pinocchio", p, given)


def _mujoco(p: Parameters, given: Mapping[str, Any]) -> Answer:
    return _engine("mujoco", p, given)


QUESTION = Question(
    "pose",
    given=("crank_angle",),
    optional={"crank_rate": 0.0, "crank_accel": 0.0},
    answers=("coupler_angle", "rocker_angle", "coupler_rate", "rocker_rate", "coupler_accel", "rocker_accel"),
    witnesses={"analytic": _analytic, "pinocchio": _pinocchio, "mujoco": _mujoco},
    angles=ANGLES,
    units=_named(with_rates(dict.fromkeys(("crank_angle", *ANGLES, "transmission_angle"), "rad"))),
    text="angles, rates and accelerations of coupler and rocker from those of the crank",
)
