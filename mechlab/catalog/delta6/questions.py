"""Questions to the delta on poses: pose to drives and drives to pose, with rates. Witnesses: the closed form, and Pinocchio
and MuJoCo on the fidelity `full`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
from mechlab.kit.questions import by_name, stacked, together_for_engines
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


def _inverse_engine(engine: str, p: Delta6Parameters, given: Given, count: int) -> list[Answer]:
    tool, angles = (np.broadcast_to(stacked(given, names), (count, 3)) for names in (TOOL, ANGLES))
    centres = tool - p.head_offset * closed.output_axis(angles)
    rates = any(k in given for k in TWIST)
    values = dict(given) | {k: given.get(k, 0.0) for k in TWIST} if rates else given
    starts = [_start(p, centre, angle) for centre, angle in zip(centres, angles, strict=True)]
    found = _ask(engine, p, values, (*DRIVES, *(DRIVE_RATES if rates else ())), starts)
    return [_reach(_within_bend(p, x, [x.values.get(d, 0.0) for d in SLIDERS], c[2])) for x, c in zip(found, centres, strict=True)]


def _within_bend(p: Delta6Parameters, answer: Answer, sliders: Sequence[float], head: float) -> Answer:
    """The answer, or what is said of a pose beyond the bend of the ball joints."""
    beyond = _beyond_bend(p, np.array(sliders), np.asarray(head)) if answer.values else None
    return answer if beyond is None else beyond


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


def _ask(engine: str, p: Delta6Parameters, given: Given, wanted: tuple[str, ...], starts: Sequence[Array | None]) -> list[Answer]:
    """The engine's answers on `full`, in the keys of the questions."""
    from mechlab.kit.witness import engine_answers  # not before a question is asked

    asked = {OF_FRAME.get(k, k): v for k, v in given.items()}
    names = {OF_FRAME.get(k, k): k for k in wanted}
    found = engine_answers(engine, build(p, "full"), asked, list(names), len(starts), starts, steps=1, output="D")
    return [replace(answer, values={names[k]: v for k, v in answer.values.items()}) for answer in found]


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


def _forward_engine(engine: str, p: Delta6Parameters, given: Given, count: int) -> list[Answer]:
    sliders, shafts = (np.broadcast_to(stacked(given, names), (count, 3)) for names in (SLIDERS, ROTARY))
    found = closed.forward(p.geometry, sliders, shafts)
    reachable = found.translation.assembles & found.translation.on_branch
    starts = [
        _start(p, x, angles) if there else None
        for x, angles, there in zip(found.translation.position, found.angles, reachable, strict=True)
    ]
    rates = any(k in given for k in DRIVE_RATES)
    values = dict(given) | {k: given.get(k, 0.0) for k in DRIVE_RATES} if rates else given
    out = []
    for answer, at in zip(_ask(engine, p, values, (*POSE, *(TWIST if rates else ())), starts), sliders, strict=True):
        if answer.values:
            axis = closed.output_axis(np.array([answer.values[k] for k in ANGLES]))
            answer = _within_bend(p, answer, at.tolist(), answer.values["z"] - p.head_offset * axis[2])
        # accelerations are not asked for: what was taken for them does not matter
        out.append(_reach(replace(answer, assumed={})))
    return out


INVERSE = Question(
    "inverse", POSE, (*DRIVES, *DRIVE_RATES), {"analytic": _inverse_analytic} | together_for_engines(_inverse_engine), dict.fromkeys(TWIST),
    angles=(*ROTARY, *ANGLES), units=UNITS, text="drives from the pose of D; their rates from its twist",
)  # fmt: skip
FORWARD = Question(
    "forward", DRIVES, (*POSE, *TWIST), {"analytic": _forward_analytic} | together_for_engines(_forward_engine), dict.fromkeys(DRIVE_RATES),
    angles=(*ROTARY, *ANGLES), units=UNITS, text="pose of D from the drives; its twist from their rates",
)  # fmt: skip
QUESTIONS = (INVERSE, FORWARD)
"""Rates are answered when any rate is given; the others of them are then 0."""
