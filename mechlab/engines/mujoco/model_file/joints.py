"""Findings on joints and their actuators: ranges, angles in the wrong unit, what a servo is allowed to command, filters."""

from __future__ import annotations

import copy
from collections.abc import Iterator

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.rows import name_of
from mechlab.engines.mujoco.model_file.start import SINGLE, outside_ranges, start_data
from mechlab.experiment.recording import Symptom
from mechlab.mechanism.geometry import Array
from mechlab.tables import listed

BEYOND = 0.1
"""A servo that may command positions beyond the range of its joint by this share of the range, or more, is reported."""
IN_DEGREES = 10.0
"""Commands this many times as wide as the range of the joint are probably in degrees."""


def limits(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    """Finding "beyond_range": a joint that starts outside its range is pushed by its stop; the number is the acceleration."""
    outside = list(outside_ranges(model, qpos))
    if not outside:
        return
    texts = []
    for j in outside:
        value, (low, high) = qpos[model.jnt_qposadr[j]], model.jnt_range[j]
        texts.append(f"{name_of(model, 'JOINT', j)} ({value:.4g}, range {low:.4g} to {high:.4g})")
    push = _push_of_limits(model, qpos, outside)
    where = "the first keyframe" if model.nkey else "the reference pose (the file has no keyframe)"
    text = f"{where} is outside the range of {listed(texts)}: the stop pushes from the first step on"
    text += f", with up to {push:.3g} rad/s^2 or m/s^2. Start somewhere else, or write a keyframe inside the ranges."
    yield Symptom("beyond_range", "warning", text, _keyframe(model, qpos), push)


def _push_of_limits(model: mujoco.MjModel, qpos: Array, joints: list[int]) -> float:
    """Largest acceleration of these joints that their stops add at the start."""
    found = []
    for off in (0, int(mujoco.mjtDisableBit.mjDSBL_LIMIT)):
        probe = copy.copy(model)
        probe.opt.disableflags |= off
        data = start_data(probe, qpos)
        with engine():
            mujoco.mj_forward(probe, data)
        found.append(np.array(data.qacc[model.jnt_dofadr[joints]]))
    return float(np.max(np.abs(found[0] - found[1])))


def _keyframe(model: mujoco.MjModel, qpos: Array) -> str:
    """A keyframe with every joint inside its range; "" for a large model or one with equalities, which it would have to close."""
    if model.nq > 40 or model.neq:
        return ""
    inside = np.array(qpos)
    for j in range(model.njnt):
        if model.jnt_limited[j] and int(model.jnt_type[j]) in SINGLE:
            k = model.jnt_qposadr[j]
            inside[k] = np.clip(inside[k], *model.jnt_range[j])
    return f'<keyframe><key name="inside" qpos="{" ".join(f"{x:.6g}" for x in inside)}"/></keyframe>'


def commands(model: mujoco.MjModel) -> Iterator[Symptom]:
    """Findings "control_beyond_range" and "fast_activation" on actuators."""
    wide, degrees, worst, cure = [], False, 0.0, ""
    for k, j, asked, back in _servos(model):
        low, high = model.jnt_range[j]
        beyond = max(low - asked[0], asked[1] - high) / (high - low)
        if beyond < BEYOND:
            continue
        unit = "rad" if int(model.jnt_type[j]) == SINGLE[0] else "m"
        wide.append(f"{name_of(model, 'ACTUATOR', k)} ({asked[0]:.4g} to {asked[1]:.4g} {unit}, joint {low:.4g} to {high:.4g})")
        degrees |= bool(np.ptp(asked) > IN_DEGREES * (high - low))
        if beyond > worst:
            worst, cure = beyond, f'ctrlrange="{back[0]:.6g} {back[1]:.6g}" on {name_of(model, "ACTUATOR", k)}'
    if wide:
        text = f"{listed(wide)} may be commanded beyond the range of the joint, by up to {worst:.3g} times the range"
        text += ": degrees, where the joint has radians?" if degrees else "."
        yield Symptom("control_beyond_range", "warning", text, cure, worst)
    yield from _fast_activation(model)


def ranges_to_command(model: mujoco.MjModel) -> dict[str, tuple[float, float]]:
    """By name of a servo, the ctrlrange that ends where the range of its joint does, for those that may be commanded beyond."""
    out = {}
    for k, j, asked, back in _servos(model):
        low, high = model.jnt_range[j]
        if max(low - asked[0], asked[1] - high) >= BEYOND * (high - low):
            out[name_of(model, "ACTUATOR", k)] = (float(back[0]), float(back[1]))
    return out


def _servos(model: mujoco.MjModel) -> Iterator[tuple[int, int, Array, Array]]:
    """(actuator, joint, positions [rad, m] that its ctrlrange commands, ctrlrange that commands the range of the joint) of every
    position servo on a joint, both limited."""
    joint_kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    if len(model.actuator_dyntype) != model.nu:  # actuators with several controls have no ctrlrange of their own
        return
    for k in range(model.nu):
        j, kp = int(model.actuator_trnid[k, 0]), -float(model.actuator_biasprm[k, 1])
        affine = model.actuator_biastype[k] == mujoco.mjtBias.mjBIAS_AFFINE and kp > 0 and model.actuator_ctrllimited[k]
        if not affine or int(model.actuator_trntype[k]) not in joint_kinds:
            continue
        gear, gain = float(model.actuator_gear[k, 0]), float(model.actuator_gainprm[k, 0]) / kp
        if gear and gain and model.jnt_limited[j] and int(model.jnt_type[j]) in SINGLE:
            # at rest: gain ctrl = gear q, where forces are kp (gain ctrl - gear q)
            yield k, j, np.sort(model.actuator_ctrlrange[k] * gain / gear), np.sort(model.jnt_range[j] * gear / gain)


def _fast_activation(model: mujoco.MjModel) -> Iterator[Symptom]:
    h, kind = float(model.opt.timestep), mujoco.mjtDyn.mjDYN_FILTER
    filters = [k for k in range(len(model.actuator_dyntype)) if model.actuator_dyntype[k] == kind]
    quick = [k for k in filters if model.actuator_dynprm[k, 0] < h]
    if quick:
        names = [name_of(model, "ACTUATOR", k) for k in quick]
        text = f"the time constant of {listed(names)} is below the timestep {h:g} s: the filter is unstable or does nothing."
        yield Symptom("fast_activation", "error", text, 'dyntype="filterexact"', float(model.actuator_dynprm[quick[0], 0]))


TEN_TURNS = 3600.0
"""Largest angle [deg] that somebody may have meant; a wider range, such as the 1e9 rad of a URDF joint without one, is no range."""


def angles(model: mujoco.MjModel, radian: bool, unit_given: bool) -> Iterator[Symptom]:
    """Finding "degrees": ranges and springs of hinges that look like radians in a file in degrees, or degrees in a file in radians.

    The values are those of the compiled model, so includes, default classes and the types of joints count as they do in a run.
    radian: the unit of the file; unit_given: whether it says so, or has MJCF's default, degrees.
    """
    known: dict[str, tuple[float, ...]] = {}
    for j in range(model.njnt):
        kind = int(model.jnt_type[j])
        if model.jnt_limited[j] and kind in (SINGLE[0], int(mujoco.mjtJoint.mjJNT_BALL)):
            known[name_of(model, "JOINT", j)] = tuple(float(x) for x in model.jnt_range[j])
    biggest = max((abs(x) for v in known.values() for x in v), default=0.0)
    if radian:
        wrong = [f"{n} = {_list(v)} rad" for n, v in known.items() if 8.0 * np.pi < max(map(abs, v)) <= TEN_TURNS]
        if wrong:
            yield Symptom(
                "degrees", "error", f'range of {listed(wrong)}: degrees, under angle="radian"?', '<compiler angle="degree"/>', biggest
            )
    elif known and biggest < np.radians(2.0 * np.pi + 0.01):
        written = {n: tuple(float(f"{x:.9g}") for x in np.degrees(v)) for n, v in known.items()}
        exact = len(known) > 2 or any(_of_pi(x) for v in written.values() for x in v)
        text = (
            f"range of {listed([f'{n} = {_list(v)}' for n, v in written.items()])} is read in degrees"
            f"{'' if unit_given else ', the default of MJCF'}: {np.degrees(biggest):.4g} is {biggest:.3g} rad. Radians are meant?"
        )
        yield Symptom("degrees", "error" if exact else "warning", text, '<compiler angle="radian"/>', biggest)


def _of_pi(x: float) -> bool:
    """True for a nonzero multiple of pi/12 written with more than one decimal: such an angle is probably in radians."""
    turns = abs(x) / (np.pi / 12)
    return round(turns) > 0 and abs(turns - round(turns)) < 1e-3 * turns and abs(x - round(x, 1)) > 1e-6


def _list(values: tuple[float, ...]) -> str:
    return " ".join(f"{x:.6g}" for x in values)
