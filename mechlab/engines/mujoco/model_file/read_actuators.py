"""Actuators of a compiled MuJoCo model as drives, in the units of the file's controls."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import OBJECT, Remarks, given_name, key
from mechlab.engines.mujoco.model_file.read_tendons import Tendons
from mechlab.engines.mujoco.model_file.read_tree import CompiledTree, actuators_on, switched_off
from mechlab.formats.mjcf.control import LinearActuator, drive_of
from mechlab.formats.mjcf.source import Names
from mechlab.mechanism.parts import Drive, Winding
from mechlab.tables import listed

TRANSMISSION, DISABLE = mujoco.mjtTrn, mujoco.mjtDisableBit
VOLTAGE = 8
"""MuJoCo's code of a DC motor whose control is the voltage."""
LAGS = {
    mujoco.mjtDyn.mjDYN_FILTER: "a lag of first order",
    mujoco.mjtDyn.mjDYN_FILTEREXACT: "a lag of first order",
    mujoco.mjtDyn.mjDYN_INTEGRATOR: "it integrates its control",
}


def read_actuators(tree: CompiledTree, tendons: Tendons) -> tuple[list[Drive], dict[str, str]]:
    """The drives, and the map from the file's actuators to them."""
    model = tree.model
    names = Names("actuator")
    drives: list[Drive] = []
    of: dict[str, str] = {}
    if switched_off(model, DISABLE.mjDSBL_ACTUATION) and model.nu:
        tree.remarks.notes.append("the file switches its actuators off; here they are drives and act.")
    bounds = _joint_bounds(tree, tendons)
    pushing, uneven, disabled = [], [], []
    for k in range(len(model.actuator_trntype)):
        label = key(model, OBJECT.mjOBJ_ACTUATOR, k)
        on = _target(tree, tendons, k)
        found = _motor(model, k) or _linear(tree.remarks, model, k, label, on)
        if found is None or on is None:
            continue
        name = names.add(given_name(model, OBJECT.mjOBJ_ACTUATOR, k), on[0])
        of[label] = name
        forces = _range(model.actuator_forcelimited[k], model.actuator_forcerange[k])
        if k in bounds:
            forces = _both(forces, bounds[k])
        if isinstance(found, Winding):
            limit = None if forces is None else max(-forces[0], forces[1]) * abs(float(model.actuator_gear[k, 0]))
            drives.append(Drive(name, on[0], limit=limit, winding=found))
            continue
        drive = drive_of(name, on[0], replace(found, force_range=forces), on[1])
        drives.append(drive)
        group = int(model.actuator_group[k])
        if 0 <= group < 31 and model.opt.disableactuator >> group & 1:
            disabled.append(label)
        if found.pushes:
            pushing.append(label)
        if (drive.stiffness or drive.damping) and drive.control and drive.control.force_range:
            uneven.append(label)
    _note(tree.remarks, disabled, "the file switches off by their group, and that are drives here")
    _note(tree.remarks, pushing, "push at the control 0; as drives they rest there")
    _note(
        tree.remarks,
        uneven,
        "have other bounds of their force in one sense than in the other; as held drives the larger one bounds both",
    )
    return drives, of


def _note(remarks: Remarks, names: list[str], text: str) -> None:
    if names:
        remarks.notes.append(f"actuators that {text}: {listed(names)}.")


def _target(tree: CompiledTree, tendons: Tendons, k: int) -> tuple[str, float] | None:
    """Joint or shaft that an actuator acts on, and its value in the file's reference pose; None for other transmissions."""
    model = tree.model
    kind, number = TRANSMISSION(model.actuator_trntype[k]), int(model.actuator_trnid[k, 0])
    if kind in (TRANSMISSION.mjTRN_JOINT, TRANSMISSION.mjTRN_JOINTINPARENT):
        names = tree.joints_of[number]
        return (names[0], tree.zero[names[0]]) if len(names) == 1 and names[0] in tree.zero else None
    if kind == TRANSMISSION.mjTRN_TENDON and number in tendons.shafts:
        shaft = tendons.shafts[number]
        return shaft.name, shaft.zero
    return None


def _linear(
    remarks: Remarks, model: mujoco.MjModel, k: int, label: str, on: tuple[str, float] | None
) -> LinearActuator | None:
    """The actuator as force = gain u + bias; None, named as lost, for anything else."""
    kinds = (
        mujoco.mjtGain(model.actuator_gaintype[k]).name.removeprefix("mjGAIN_").lower(),
        mujoco.mjtBias(model.actuator_biastype[k]).name.removeprefix("mjBIAS_").lower(),
    )
    if kinds not in (("fixed", "none"), ("fixed", "affine")):
        remarks.lose("actuator", label, f"its gain is of type {kinds[0]}, its bias of type {kinds[1]}")
        return None
    if on is None:
        kind = TRANSMISSION(model.actuator_trntype[k]).name.removeprefix("mjTRN_").lower()
        remarks.lose("actuator", label, f"it acts on a {kind}, not on one joint or fixed tendon")
        return None
    bias = model.actuator_biasprm[k, :3] if kinds[1] == "affine" else np.zeros(3)
    if bias[1] > 0.0 or bias[2] > 0.0:
        remarks.lose("actuator", label, "its stiffness or damping is negative")
        return None
    gear = float(model.actuator_gear[k, 0])
    if gear == 0.0:
        remarks.lose("actuator", label, "its gear is 0")
        return None
    dynamics = mujoco.mjtDyn(model.actuator_dyntype[k])
    if dynamics != mujoco.mjtDyn.mjDYN_NONE:
        why = LAGS.get(dynamics, "its activation has a law of its own")
        remarks.lose("activation of an actuator", label, f"{why}; here its force follows the control at once")
    if np.any(model.actuator_delay[k]):
        remarks.lose("delay of an actuator", label, "here its force follows the control at once")
    return LinearActuator(
        float(model.actuator_gainprm[k, 0]), float(bias[0]), -float(bias[1]) or 0.0, -float(bias[2]) or 0.0, gear,
        _range(model.actuator_ctrllimited[k] and not switched_off(model, DISABLE.mjDSBL_CLAMPCTRL), model.actuator_ctrlrange[k]),
        _range(model.actuator_forcelimited[k], model.actuator_forcerange[k]),
    )  # fmt: skip


def _motor(model: mujoco.MjModel, k: int) -> Winding | None:
    """The winding of a DC motor on a joint whose input is the voltage, and which has no losses or controller of its own."""
    if mujoco.mjtDyn(model.actuator_dyntype[k]) != mujoco.mjtDyn.mjDYN_DCMOTOR:
        return None
    resistance, constant = (float(x) for x in model.actuator_gainprm[k, :2])
    rest = (model.actuator_gainprm[k, 2:], model.actuator_biasprm[k], model.actuator_dynprm[k, 1:])
    plain = model.actuator_ctrlspec[k] == VOLTAGE and not any(np.any(x) for x in rest) and resistance > 0.0
    gear = float(model.actuator_gear[k, 0])
    return (
        Winding(constant * gear, resistance, float(model.actuator_dynprm[k, 0]) * resistance)
        if plain and gear
        else None
    )


def _range(limited: bool, ends: np.ndarray) -> tuple[float, float] | None:
    return (float(ends[0]), float(ends[1])) if limited else None


def _both(one: tuple[float, float] | None, two: tuple[float, float]) -> tuple[float, float]:
    """The forces that two bounds allow; where they do not meet, the end of the second that is nearest to the first."""
    if one is None:
        return two
    low, high = (min(max(x, two[0]), two[1]) for x in one)
    return low, high


def _joint_bounds(tree: CompiledTree, tendons: Tendons) -> dict[int, tuple[float, float]]:
    """actuator -> bounds of its force from those of the total actuator force of its joint or tendon. Several actuators with one
    such bound are more than drives can say: it is named as lost."""
    model = tree.model
    through: dict[int, list[int]] = {}
    for tendon, terms in tendons.fixed.items():
        for name, _ in terms:
            joint = next(k for k, names in tree.joints_of.items() if name in names)
            through.setdefault(joint, []).extend(k for k, _ in actuators_on(model, TRANSMISSION.mjTRN_TENDON, tendon))
    out: dict[int, tuple[float, float]] = {}
    for kind, limited, ranges, transmission in (
        (OBJECT.mjOBJ_TENDON, model.tendon_actfrclimited, model.tendon_actfrcrange, TRANSMISSION.mjTRN_TENDON),
        (OBJECT.mjOBJ_JOINT, model.jnt_actfrclimited, model.jnt_actfrcrange, TRANSMISSION.mjTRN_JOINT),
    ):
        for k in np.flatnonzero(limited):
            here = actuators_on(model, transmission, int(k))
            others = through.get(int(k), []) if kind == OBJECT.mjOBJ_JOINT else []
            if len(here) == 1 and not others and here[0][1]:
                ends = sorted(float(x) / here[0][1] for x in ranges[k])
                out[here[0][0]] = (ends[0], ends[1])
            elif here or others:
                why = "a bound on the sum of several actuators"
                tree.remarks.lose("actuatorfrcrange", key(model, kind, int(k)), why)
    return out
