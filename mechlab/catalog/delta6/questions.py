"""Questions to the delta: pose to drives and drives to pose, with rates; closed form, Pinocchio and MuJoCo on `full`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic import delta6 as closed_form
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import Delta6Parameters, DRIVES
from mechlab.catalog.delta6.poses import coordinates
from mechlab.errors import NoSolution
from mechlab.experiment.question import Answer, Question
from mechlab.kit.witness import engine_answer
from mechlab.mechanism import Status
from mechlab.mechanism.geometry import Array
from mechlab.tables import up_to

POSE = ("x", "y", "z", "alpha", "beta", "gamma")
TWIST = ("x_rate", "y_rate", "z_rate", "wx", "wy", "wz")
DRIVES = DRIVES
DRIVE_RATES = tuple(f"{d}_rate" for d in DRIVES)
ANGLES = ("phi1", "phi2", "phi3", "alpha", "beta", "gamma")
START_OFFSET = 1e-3
"""The engines start this far off the closed form in every coordinate: near enough for the mode, not an answer."""

_TO_FRAME = {"x": "D_x", "y": "D_y", "z": "D_z", "x_rate": "D_x_rate", "y_rate": "D_y_rate", "z_rate": "D_z_rate",
             "wx": "D_wx", "wy": "D_wy", "wz": "D_wz"}  # fmt: skip
UNITS = (
    dict.fromkeys(("x", "y", "z", "q1", "q2", "q3"), "m") | dict.fromkeys(ANGLES, "rad") | dict.fromkeys(TWIST[:3], "m/s")
    | dict.fromkeys(TWIST[3:], "rad/s") | dict.fromkeys(DRIVE_RATES[:3], "m/s") | dict.fromkeys(DRIVE_RATES[3:], "rad/s")
)  # fmt: skip


def _stack(given: Mapping[str, Any], names: tuple[str, ...]) -> Array:
    return np.stack(np.broadcast_arrays(*(np.asarray(given[n], dtype=float) for n in names)), axis=-1)


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


# -- pose to drives --------------------------------------------------------------------------------------------------------


def _inverse_analytic(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    tool = _stack(given, POSE[:3])
    found = closed_form.inverse(p.geometry, tool, given["alpha"], given["beta"], given["gamma"])
    if not np.all(found.reachable):
        return _unreachable("smallest L^2 - |G|^2 is", found.translation.h2, "m2", found.reachable)
    if (beyond := _beyond_bend(p, found.drives[..., :3], found.head_centre[..., 2])) is not None:
        return beyond
    status, notes = _singular_status(found.singular, found.translation.h2, p.rod_length)
    values = {name: found.drives[..., k] for k, name in enumerate(DRIVES)}
    if any(k in given for k in TWIST):
        twist = _stack({k: given.get(k, 0.0) for k in TWIST}, TWIST)
        try:
            rates = closed_form.drive_rates(p.geometry, tool, given["alpha"], given["beta"], given["gamma"], twist)
        except NoSolution as cause:
            return Answer(values, Status.BOUNDARY, (*notes, str(cause)))
        values |= {name: rates[..., k] for k, name in enumerate(DRIVE_RATES)}
    return Answer(values, status, notes + slider_notes(p, found.drives[..., :3]))


def _start(p: Delta6Parameters, centre: Array, angles: Array) -> Array | None:
    try:
        return coordinates(p, "full", centre, angles)[0] + START_OFFSET
    except NoSolution:
        return None


def _normalised(p: Delta6Parameters, start: Array | None) -> Array | None:
    """Quaternions that were moved are normalised again."""
    if start is None:
        return None
    m = build(p, "full")
    out = start.copy()
    for joint in m.joints:
        if joint.kind == "spherical":
            s = m.q_slice[joint.name]
            out[s] /= np.linalg.norm(out[s])
    return out


def _inverse_engine(engine: str, p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    angles = np.array([given["alpha"], given["beta"], given["gamma"]], dtype=float)
    tool = np.array([given["x"], given["y"], given["z"]], dtype=float)
    centre = tool - p.head_offset * closed_form.output_axis(angles)
    start = _normalised(p, _start(p, centre, angles))
    asked = {_TO_FRAME.get(k, k): v for k, v in given.items()}
    if any(k in given for k in TWIST):
        asked |= {_TO_FRAME[k]: given.get(k, 0.0) for k in TWIST}
    wanted = list(DRIVES) + (list(DRIVE_RATES) if any(k in given for k in TWIST) else [])
    answer = engine_answer(
        engine, build(p, "full"), asked, wanted, start=start, steps=1 if start is not None else 10, output="D"
    )
    if answer.values:
        beyond = _beyond_bend(p, np.array([answer.values[d] for d in DRIVES[:3]]), centre[2])
        if beyond is not None:
            return beyond
    return _reach(answer)


def _reach(answer: Answer) -> Answer:
    """No closed pose means, for this mechanism, out of reach."""
    if (
        not answer.values
        and not answer.cannot
        and answer.status in (Status.NOT_CONVERGED, Status.CHANGE_POINT, Status.NO_ASSEMBLY)
    ):
        return Answer(status=Status.OUT_OF_REACH, notes=answer.notes)
    return answer


# -- drives to pose --------------------------------------------------------------------------------------------------------


def _forward_analytic(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    sliders, shafts = _stack(given, DRIVES[:3]), _stack(given, DRIVES[3:])
    found = closed_form.forward(p.geometry, sliders, shafts)
    if not np.all(found.translation.assembles):
        return _unreachable("smallest L^2 - circumradius^2 is", found.translation.discriminant, "m2")
    if not np.all(found.translation.on_branch):
        return Answer(status=Status.OUT_OF_REACH, notes=("it assembles only with a rod that points upwards",))
    if (beyond := _beyond_bend(p, sliders, found.translation.position[..., 2])) is not None:
        return beyond
    values = {name: found.tool[..., k] for k, name in enumerate(POSE[:3])}
    values |= {name: found.angles[..., k] for k, name in enumerate(POSE[3:])}
    status, notes = _singular_status(found.singular, np.min(found.translation.heights**2, axis=-1), p.rod_length)
    if any(k in given for k in DRIVE_RATES):
        rates = _stack({k: given.get(k, 0.0) for k in DRIVE_RATES}, DRIVE_RATES)
        al, be, ga = (found.angles[..., k] for k in range(3))
        twist = closed_form.output_twist(p.geometry, found.tool, al, be, ga, rates)
        values |= {name: twist[..., k] for k, name in enumerate(TWIST)}
    return Answer(values, status, notes + slider_notes(p, sliders))


def _forward_engine(engine: str, p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    sliders = np.array([given[k] for k in DRIVES[:3]], dtype=float)
    shafts = np.array([given[k] for k in DRIVES[3:]], dtype=float)
    found = closed_form.forward(p.geometry, sliders, shafts)
    reachable = bool(found.translation.assembles) and bool(found.translation.on_branch)
    start = _normalised(p, _start(p, found.translation.position, found.angles)) if reachable else None
    rates = any(k in given for k in DRIVE_RATES)
    asked = dict(given) | ({k: given.get(k, 0.0) for k in DRIVE_RATES} if rates else {})
    names = [*POSE, *(TWIST if rates else ())]
    answer = engine_answer(
        engine,
        build(p, "full"),
        asked,
        [_TO_FRAME.get(k, k) for k in names],
        start=start,
        steps=1 if start is not None else 10,
        output="D",
    )
    back = {_TO_FRAME.get(k, k): k for k in names}
    renamed = {back[k]: v for k, v in answer.values.items()}
    if renamed:
        axis = closed_form.output_axis(np.array([renamed[k] for k in POSE[3:]]))
        beyond = _beyond_bend(p, sliders, renamed["z"] - p.head_offset * axis[2])
        if beyond is not None:
            return beyond
    return _reach(Answer(renamed, answer.status, answer.notes, cannot=answer.cannot, details=answer.details))


def _pinocchio_inverse(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    return _inverse_engine("pinocchio", p, given)


def _mujoco_inverse(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    return _inverse_engine("mujoco", p, given)


def _pinocchio_forward(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    return _forward_engine("pinocchio", p, given)


def _mujoco_forward(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    return _forward_engine("mujoco", p, given)


def _question(
    name: str,
    given: tuple[str, ...],
    rates: tuple[str, ...],
    answers: tuple[str, ...],
    witnesses: dict[str, Any],
    text: str,
) -> Question:
    """Rates are answered when any rate is given; the others of them are then 0."""
    return Question(name, given, answers, witnesses, dict.fromkeys(rates), angles=ANGLES, units=UNITS, text=text)


_INVERSE = {"analytic": _inverse_analytic, "pinocchio": _pinocchio_inverse, "mujoco": _mujoco_inverse}
_FORWARD = {"analytic": _forward_analytic, "pinocchio": _pinocchio_forward, "mujoco": _mujoco_forward}

QUESTIONS = (
    _question(
        "inverse",
        POSE,
        TWIST,
        (*DRIVES, *DRIVE_RATES),
        _INVERSE,
        "drives from the pose of D; their rates from its twist",
    ),
    _question(
        "forward",
        DRIVES,
        DRIVE_RATES,
        (*POSE, *TWIST),
        _FORWARD,
        "pose of D from the drives; its twist from their rates",
    ),
)
