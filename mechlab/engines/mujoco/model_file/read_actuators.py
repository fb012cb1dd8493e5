"""Actuators of a compiled MuJoCo model as drives, in the units of the file's controls."""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import OBJECT, Remarks, given_name, key
from mechlab.engines.mujoco.model_file.read_tendons import Tendons
from mechlab.engines.mujoco.model_file.read_tree import CompiledTree, switched_off
from mechlab.formats.mjcf.control import LinearActuator, drive_of
from mechlab.formats.mjcf.source import Names
from mechlab.mechanism.parts import Drive

TRANSMISSION, DISABLE = mujoco.mjtTrn, mujoco.mjtDisableBit
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
        tree.remarks.notes.append("the file switches its actuators off; here they are drives that wait for a law.")
    for k in range(len(model.actuator_trntype)):
        label = key(model, OBJECT.mjOBJ_ACTUATOR, k)
        on = _target(tree, tendons, k)
        actuator = _linear(tree.remarks, model, k, label, on)
        if actuator is None or on is None:
            continue
        name = names.add(given_name(model, OBJECT.mjOBJ_ACTUATOR, k), on[0])
        drives.append(drive_of(name, on[0], actuator, on[1]))
        of[label] = name
        if actuator.pushes:
            tree.remarks.notes.append(f"the actuator {label!r} pushes at the control 0; as a drive it rests there.")
    _joint_limits(tree, of)
    return drives, of


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


def _range(limited: bool, ends: np.ndarray) -> tuple[float, float] | None:
    return (float(ends[0]), float(ends[1])) if limited else None


def _joint_limits(tree: CompiledTree, of: dict[str, str]) -> None:
    """Names the limits of the total actuator force of a joint or tendon."""
    model = tree.model
    for kind, limited, count in (
        (OBJECT.mjOBJ_JOINT, model.jnt_actfrclimited, model.njnt),
        (OBJECT.mjOBJ_TENDON, model.tendon_actfrclimited, model.ntendon),
    ):
        for k in range(count):
            if limited[k]:
                tree.remarks.lose("actuatorfrcrange", key(model, kind, k), "a bound on the sum of the actuators there")
