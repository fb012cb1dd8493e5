"""Questions to the delta on poses: pose to drives and drives to pose, with rates. Witnesses: the closed form, and Pinocchio
and MuJoCo on the fidelity `full`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import ANGLES, DRIVES, ROTARY, SLIDERS, Delta6Parameters
from mechlab.catalog.delta6.poses import coordinates
from mechlab.errors import NoSolution
from mechlab.experiment.question import Answer, Question
from mechlab.kit.questions import by_name, for_engines, stacked
from mechlab.kit.witness import engine_answer
from mechlab.mechanism import Status
from mechlab.mechanism.geometry import Array
from mechlab.tables import up_to

Given = Mapping[str, Any]

TOOL = ("x", "y", "z")
POSE = (*TOOL, *ANGLES)
TWIST = ("x_rate", "y_rate", "z_rate", "wx", "wy", "wz")
DRIVE_RATES = tuple(f"{d}_rate" for d in DRIVES)
OF_FRAME = {key: f"D_{key}" for key in (*TOOL, *TWIST)}
"""Keys of the questions -> quantities of the frame D; the other keys are those of the mechanism."""
UNITS = (
    dict.fromkeys((*TOOL, *SLIDERS), "m") | dict.fromkeys((*ROTARY, *ANGLES), "rad") | dict.fromkeys(TWIST[:3], "m/s")
    | dict.fromkeys(TWIST[3:], "rad/s") | dict.fromkeys(DRIVE_RATES[:3], "m/s") | dict.fromkeys(DRIVE_RATES[3:], "rad/s")
)  # fmt: skip
START_OFFSET = 1e-3
"""The engines start this far off the closed form in every coordinate: near enough for the mode, not an answer."""


def _unreachable(what: str, measure: Array, unit: str, solved: NDArray[np.bool_] | None = None) -> Answer:
    worst = float(np.min(measure))
    text = f"{what} {worst:.6g} {unit}"
    return Answer(status=Status.OUT_OF_REACH, notes=(text,), details={"margin": worst}, solved=solved)


def slider_notes(p: Delta6Parameters, sliders: Array) -> tuple[str, ...]:
    """Warnings where sliders leave their range; a pose stays an answer."""
    notes = []
    for k in range(3):
        q = sliders[..., k]
        if np.any(q < p.slider_min) or np.any(q > p.slider_max):
            notes.append(f"q{k + 1} leaves its range {p.slider_min:g} to {p.slider_max:g} m")
    return tuple(notes)


def _beyond_bend(p: Delta6Parameters, sliders: Array, height: ArrayLike) -> Answer | None:
    """Out of reach where a cardan bends more than bend_limit; None within it, or without a limit.

    sliders (..., 3) and the height (...,) of the head centre O [m]: a rod rises h = q - z - platform_height - slider_height,
    its cardan bends acos(h / L).
    """
    if p.bend_limit is None:
        return None
    rise = np.asarray(sliders) - np.asarray(height)[..., None] - p.platform_height - p.slider_height
    bends = np.max(np.arccos(np.clip(rise / p.rod_length, -1.0, 1.0)), axis=-1)
    bend = float(np.max(bends))
    if bend <= p.bend_limit:
        return None
    text = f"a cardan bends {up_to(bends)}{np.degrees(bend):.6g} deg, more than bend_limit, {np.degrees(p.bend_limit):.6g} deg"
    return Answer(status=Status.OUT_OF_REACH, notes=(text,), details={"bend": bend}, solved=bends <= p.bend_limit)


def _singular_status(singular: ArrayLike, h2: Array, length: float) -> tuple[Status, tuple[str, ...]]:
    notes: list[str] = []
    if np.any(singular):
        notes.append(
            "serial singularity: beta = +-90 deg, the axes of alpha and gamma coincide and one angular velocity is lost"
        )
    if np.any(h2 <= 1e-12 * length**2):
        notes.append("serial singularity: a rod lies horizontal, its slider would need an infinite rate")
    return (Status.BOUNDARY if notes else Status.SOLVED), tuple(notes)


def _inverse_analytic(p: Delta6Parameters, given: Given) -> Answer:
    tool = stacked(given, TOOL)
    found = closed.inverse(p.geometry, tool, given["alpha"], given["beta"], given["gamma"])
    if not np.all(found.reachable):
        return _unreachable("smallest L^2 - |G|^2 is", found.translation.h2, "m2", found.reachable)
    if (beyond := _beyond_bend(p, found.drives[..., :3], found.head_centre[..., 2])) is not None:
        return beyond
    status, notes = _singular_status(found.singular, found.translation.h2, p.rod_length)
    values = by_name(DRIVES, found.drives)
    if any(k in given for k in TWIST):
        twist = stacked(given, TWIST)
        try:
            rates = closed.drive_rates(p.geometry, tool, given["alpha"], given["beta"], given["gamma"], twist)
        except NoSolution as cause:
            return Answer(values, Status.BOUNDARY, (*notes, str(cause)))
        values |= by_name(DRIVE_RATES, rates)
    return Answer(values, status, notes + slider_notes(p, found.drives[..., :3]))


def _inverse_engine(engine: str, p: Delta6Parameters, given: Given) -> Answer:
    tool, angles = stacked(given, TOOL), stacked(given, ANGLES)
    centre = tool - p.head_offset * closed.output_axis(angles)
    rates = any(k in given for k in TWIST)
    values = dict(given) | {k: given.get(k, 0.0) for k in TWIST} if rates else given
    answer = _ask(engine, p, values, (*DRIVES, *(DRIVE_RATES if rates else ())), _start(p, centre, angles))
    if answer.values:
        beyond = _beyond_bend(p, np.array([answer.values[d] for d in SLIDERS]), centre[2])
        if beyond is not None:
            return beyond
    return _reach(answer)


def _start(p: Delta6Parameters, centre: Array, angles: Array) -> Array | None:
    """Where an engine starts: near the closed form; None out of reach."""
    try:
        start = coordinates(p, "full", centre, angles)[0] + START_OFFSET
    except NoSolution:
        return None
    m = build(p, "full")
    for joint in m.joints:
        if joint.kind == "spherical":
            s = m.q_slice[joint.name]
            start[s] /= np.linalg.norm(start[s])
    return start


def _ask(engine: str, p: Delta6Parameters, given: Given, wanted: tuple[str, ...], start: Array | None) -> Answer:
    """The engine's answer on `full`, in the keys of the questions."""
    asked = {OF_FRAME.get(k, k): v for k, v in given.items()}
    names = {OF_FRAME.get(k, k): k for k in wanted}
    steps = 1 if start is not None else 10
    answer = engine_answer(engine, build(p, "full"), asked, list(names), start=start, steps=steps, output="D")
    return replace(answer, values={names[k]: v for k, v in answer.values.items()})


def _reach(answer: Answer) -> Answer:
    """No closed pose means, for this mechanism, out of reach."""
    open_loops = (Status.NOT_CONVERGED, Status.CHANGE_POINT, Status.NO_ASSEMBLY)
    if not answer.values and not answer.cannot and answer.status in open_loops:
        return Answer(status=Status.OUT_OF_REACH, notes=answer.notes)
    return answer


def _forward_analytic(p: Delta6Parameters, given: Given) -> Answer:
    sliders, shafts = stacked(given, SLIDERS), stacked(given, ROTARY)
    found = closed.forward(p.geometry, sliders, shafts)
    if not np.all(found.translation.assembles):
        return _unreachable("smallest L^2 - circumradius^2 is", found.translation.discriminant, "m2")
    if not np.all(found.translation.on_branch):
        return Answer(status=Status.OUT_OF_REACH, notes=("it assembles only with a rod that points upwards",))
    if (beyond := _beyond_bend(p, sliders, found.translation.position[..., 2])) is not None:
        return beyond
    values = by_name(TOOL, found.tool) | by_name(ANGLES, found.angles)
    status, notes = _singular_status(found.singular, np.min(found.translation.heights**2, axis=-1), p.rod_length)
    if any(k in given for k in DRIVE_RATES):
        rates = stacked(given, DRIVE_RATES)
        al, be, ga = (found.angles[..., k] for k in range(3))
        twist = closed.output_twist(p.geometry, found.tool, al, be, ga, rates)
        values |= by_name(TWIST, twist)
    return Answer(values, status, notes + slider_notes(p, sliders))


def _forward_engine(engine: str, p: Delta6Parameters, given: Given) -> Answer:
    sliders, shafts = stacked(given, SLIDERS), stacked(given, ROTARY)
    found = closed.forward(p.geometry, sliders, shafts)
    reachable = bool(found.translation.assembles) and bool(found.translation.on_branch)
    start = _start(p, found.translation.position, found.angles) if reachable else None
    rates = any(k in given for k in DRIVE_RATES)
    values = dict(given) | {k: given.get(k, 0.0) for k in DRIVE_RATES} if rates else given
    answer = _ask(engine, p, values, (*POSE, *(TWIST if rates else ())), start)
    if answer.values:
        axis = closed.output_axis(np.array([answer.values[k] for k in ANGLES]))
        beyond = _beyond_bend(p, sliders, answer.values["z"] - p.head_offset * axis[2])
        if beyond is not None:
            return beyond
    # accelerations are not asked for: what was taken for them does not matter
    return _reach(replace(answer, assumed={}))


INVERSE = Question(
    "inverse", POSE, (*DRIVES, *DRIVE_RATES), {"analytic": _inverse_analytic} | for_engines(_inverse_engine), dict.fromkeys(TWIST),
    angles=(*ROTARY, *ANGLES), units=UNITS, text="drives from the pose of D; their rates from its twist",
)  # fmt: skip
FORWARD = Question(
    "forward", DRIVES, (*POSE, *TWIST), {"analytic": _forward_analytic} | for_engines(_forward_engine), dict.fromkeys(DRIVE_RATES),
    angles=(*ROTARY, *ANGLES), units=UNITS, text="pose of D from the drives; its twist from their rates",
)  # fmt: skip
QUESTIONS = (INVERSE, FORWARD)
"""Rates are answered when any rate is given; the others of them are then 0."""
