"""Errors of a writer: one number of the MJCF text, or of the Pinocchio model, that is made of a right Mechanism is wrong."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from mechlab.engines.mujoco.control import engine
from mechlab.engines.pinocchio.model import PinModel
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from tests.faults.builders import Rng, one

TextAlter = Callable[[str], str]


def _numbers(values: Any) -> str:
    return " ".join(repr(float(x)) for x in values)


def _scale(key: str, factors: tuple[float, ...] | float) -> Callable[[ET.Element], None]:
    def change(e: ET.Element) -> None:
        old = [float(x) for x in e.get(key, "").split()]
        by = (
            [factors] * len(old) if isinstance(factors, float) else [factors[k % len(factors)] for k in range(len(old))]
        )
        e.set(key, _numbers(x * f for x, f in zip(old, by, strict=True)))

    return change


def _rolled(key: str) -> Callable[[ET.Element], None]:
    def change(e: ET.Element) -> None:
        e.set(key, _numbers(np.roll([float(x) for x in e.get(key, "").split()], 1)))

    return change


MJCF: dict[str, tuple[tuple[str, str, str, Callable[[ET.Element], None] | None], ...]] = {
    "sign": (
        ("joint axis flipped", "joint", "axis", _scale("axis", -1.0)),
        ("quaternion conjugated", "body", "quat", _scale("quat", (1.0, -1.0, -1.0, -1.0))),
        ("position on the other side", "body", "pos", _scale("pos", -1.0)),
        ("coefficient with the other sign", "fixed/joint", "coef", _scale("coef", -1.0)),
        ("gravity upwards", "option", "gravity", _scale("gravity", -1.0)),
    ),
    "frame": (
        ("quaternion x y z w", "body", "quat", _rolled("quat")),
        ("site on the other side", "site", "pos", _scale("pos", -1.0)),
        ("centre of mass permuted", "inertial", "pos", _rolled("pos")),
        ("site 1 % off", "site", "pos", _scale("pos", 1.01)),
    ),
    "tooth": (("coefficient 1 % more", "fixed/joint", "coef", _scale("coef", 1.01)),),
    "inertia": (
        ("mass 10 % more", "inertial", "mass", _scale("mass", 1.1)),
        (
            "products with the other sign",
            "inertial",
            "fullinertia",
            _scale("fullinertia", (1.0, 1.0, 1.0, -1.0, -1.0, -1.0)),
        ),
        ("tensor doubled", "inertial", "fullinertia", _scale("fullinertia", (2.0, 2.0, 2.0, 2.0, 2.0, 2.0))),
        ("armature doubled", "joint", "armature", _scale("armature", 2.0)),
        ("armature of a tendon doubled", "fixed", "armature", _scale("armature", 2.0)),
    ),
    "row": (("row dropped", "equality/*", "name", None),),
    "unit": (
        ("position in mm", "body", "pos", _scale("pos", 1e3)),
        ("mass in g", "inertial", "mass", _scale("mass", 1e3)),
        ("site in mm", "site", "pos", _scale("pos", 1e3)),
        ("stiffness x 10", "spatial", "stiffness", _scale("stiffness", 10.0)),
        ("damping x 10", "spatial", "damping", _scale("damping", 10.0)),
        ("joint damping x 10", "joint", "damping", _scale("damping", 10.0)),
        ("gravity in cm/s^2", "option", "gravity", _scale("gravity", 100.0)),
    ),
}
"""Kind -> (words, where, attribute, change; None drops the element)."""


def _elements(root: ET.Element, where: str, key: str) -> list[tuple[str, ET.Element, ET.Element]]:
    """(address, parent, element) of all elements of a kind that have the attribute; the address does not change with what
    else is in the file."""
    tag, _, inner = where.partition("/")
    out = []
    for parent in root.iter():
        for k, e in enumerate(parent):
            fits = e.tag == tag and not inner
            fits |= bool(inner) and parent.tag == tag and (inner == "*" or e.tag == inner)
            if fits and e.get(key) and parent.tag != "default":
                label = e.get("joint") or e.get("name") or str(k)
                out.append((f"{parent.tag}:{parent.get('name')}/{e.tag}:{label}", parent, e))
    return out


def mjcf_fault(rng: Rng, kind: str, text: str) -> tuple[str, TextAlter] | None:
    """A fault of the MJCF writer: words, and text -> text; None where this file has no such number."""
    words, where, key, change = one(rng, MJCF[kind])
    found = one(rng, _elements(ET.fromstring(text), where, key))
    if found is None:
        return None
    address = found[0]

    def alter(content: str) -> str:
        root = ET.fromstring(content)
        for label, parent, e in _elements(root, where, key):
            if label == address:
                if change is None:
                    parent.remove(e)
                else:
                    change(e)
                break
        return ET.tostring(root, encoding="unicode")

    return f"MJCF: {words} at {address}", alter


def text_marks(text: str) -> dict[str, Array]:
    """What an MJCF text is at two random states: mass matrix, forces, poses of bodies and sites, equality rows."""
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data, rng = mujoco.MjData(model), np.random.default_rng(3)
    out: dict[str, Array] = {}
    with engine():
        for k in range(2):
            mujoco.mj_resetData(model, data)
            mujoco.mj_integratePos(model, data.qpos, 0.2 * rng.standard_normal(model.nv), 1.0)
            data.qvel[:] = rng.standard_normal(model.nv)
            mujoco.mj_forward(model, data)
            mass = np.zeros((model.nv, model.nv))
            mujoco.mj_fullM(model, data, mass)
            rows = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
            out |= {
                f"mass{k}": mass,
                f"force{k}": data.qfrc_bias - data.qfrc_passive,
                f"sites{k}": np.array(data.site_xpos),
                f"bodies{k}": np.array(data.xpos),
                f"rows{k}": np.array(data.efc_pos[rows]),
            }
    return out


def pin_fault(rng: Rng, kind: str, m: Mechanism) -> tuple[str, Callable[[PinModel], PinModel]] | None:
    """A fault of the way to Pinocchio: words, and a change in place of the model; by the name of the joint or frame."""
    words = str(one(rng, PIN[kind]))
    name = str(one(rng, [j.name for j in m.joints]))

    def alter(made: PinModel) -> PinModel:
        if made.model.existJointName(name):
            PIN_CHANGES[words](made.model, made.model.getJointId(name))
        return made

    return f"Pinocchio: {words} at {name}", alter


def _turned(model: Any, k: int) -> None:
    p = model.jointPlacements[k]
    model.jointPlacements[k] = pin.SE3(p.rotation.T, p.translation)


def _shifted(model: Any, k: int) -> None:
    p = model.jointPlacements[k]
    model.jointPlacements[k] = pin.SE3(p.rotation, -p.translation)


def _long(model: Any, k: int) -> None:
    p = model.jointPlacements[k]
    model.jointPlacements[k] = pin.SE3(p.rotation, 1e3 * p.translation)


def _body(mass: float = 1.0, lever: float = 1.0, tensor: float = 1.0) -> Callable[[Any, int], None]:
    def change(model: Any, k: int) -> None:
        i = model.inertias[k]
        model.inertias[k] = pin.Inertia(mass * i.mass, lever * i.lever, tensor * i.inertia)

    return change


def _gravity(factor: float) -> Callable[[Any, int], None]:
    def change(model: Any, k: int) -> None:
        model.gravity = pin.Motion(factor * model.gravity.linear, np.zeros(3))

    return change


PIN_CHANGES: dict[str, Callable[[Any, int], None]] = {
    "placement turned backwards": _turned,
    "placement on the other side": _shifted,
    "placement in mm": _long,
    "mass 10 % more": _body(mass=1.1),
    "centre of mass on the other side": _body(lever=-1.0),
    "tensor doubled": _body(tensor=2.0),
    "gravity upwards": _gravity(-1.0),
    "gravity in cm/s^2": _gravity(100.0),
    "mass in g": _body(mass=1e3),
}
PIN: dict[str, tuple[str, ...]] = {
    "sign": ("placement on the other side", "centre of mass on the other side", "gravity upwards"),
    "frame": ("placement turned backwards",),
    "inertia": ("mass 10 % more", "tensor doubled"),
    "unit": ("placement in mm", "gravity in cm/s^2", "mass in g"),
}


def pin_marks(made: PinModel) -> dict[str, Array]:
    """What a pin.Model is at two random states."""
    model, rng = made.model, np.random.default_rng(3)
    data, out = model.createData(), {}
    for k in range(2):
        q = pin.integrate(model, pin.neutral(model), 0.2 * rng.standard_normal(model.nv))
        v = rng.standard_normal(model.nv)
        pin.framesForwardKinematics(model, data, q)
        out[f"frames{k}"] = np.array([x.translation for x in data.oMf])
        out[f"turns{k}"] = np.array([x.rotation for x in data.oMf])
        out[f"mass{k}"] = np.array(pin.crba(model, data, q))
        out[f"bias{k}"] = np.array(pin.rnea(model, data, q, v, 0 * v))
    return out
