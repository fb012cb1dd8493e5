"""What bites in a URDF: what it cannot say, and what the engines make of what it says."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator

import numpy as np

from mechlab.engines.mujoco.model_file.softness import listed
from mechlab.experiment.recording import Symptom
from mechlab.formats.xml_text import floats

MOVING = ("revolute", "continuous", "prismatic", "floating", "planar")


def urdf(root: ET.Element) -> Iterator[Symptom]:
    """Findings "massless", "triangle", "mimic", "continuous", "fixed_range", "joint_kind", "tree"."""
    yield from _masses(root)
    yield from _mimics(root)
    joints = root.findall("joint")
    turning = [_name(j) for j in joints if j.get("type") == "continuous"]
    if turning:
        text = f"{listed(turning)}: 'continuous' joints have two coordinates (cosine, sine) in Pinocchio; address q by name."
        yield Symptom("continuous", "note", text, '<joint type="revolute"> <limit lower="-1e9" upper="1e9" …/>')
    stuck = [_name(j) for j in joints if j.get("type") in ("revolute", "prismatic") and not _has_range(j)]
    if stuck:
        text = f"{listed(stuck)} has no range (lower = upper): readers disagree whether it is locked or free."
        yield Symptom(
            "fixed_range", "warning", text, '<limit lower="-3.14159" upper="3.14159" effort="100" velocity="100"/>'
        )
    odd = [f"{_name(j)} ({j.get('type')})" for j in joints if j.get("type") in ("spherical", "planar", "floating")]
    if odd:
        text = f"{listed(odd)}: not every reader knows this type (urdfdom and yourdfpy refuse 'spherical')."
        yield Symptom("joint_kind", "warning", text)
    heard = Counter(link for j in joints if (link := _child(j)))
    twice = [n for n, count in heard.items() if count > 1]
    if twice:
        text = f"{listed(twice)} hangs on two joints: a URDF is a tree, loops must be closed elsewhere (MJCF connect)."
        yield Symptom("tree", "error", text)


def _masses(root: ET.Element) -> Iterator[Symptom]:
    carried = {_child(j): j.get("type") for j in root.findall("joint")}
    below = {j.find("parent").get("link") for j in root.findall("joint") if j.find("parent") is not None}  # type: ignore[union-attr]
    empty, broken = [], []
    for link in root.findall("link"):
        name, inertial = link.get("name") or "?", link.find("inertial")
        mass = 0.0 if inertial is None else _value(inertial.find("mass"), "value")
        tensor = _tensor(inertial)
        if mass <= 0.0 and carried.get(name) in MOVING:
            empty.append((name, name in below))
        if tensor is not None and mass > 0.0:
            a, b, c = np.linalg.eigvalsh(tensor)
            if a < 0.0 or a + b < c * (1 - 1e-6):
                broken.append(f"{name} ({a:.3g}, {b:.3g}, {c:.3g})")
    if empty:
        leaf = [n for n, parent in empty if not parent]
        text = f"{listed([n for n, _ in empty])} moves and has no mass: MuJoCo refuses it"
        text += f"; {listed(leaf)} carries nothing either, the mass matrix is singular" if leaf else ""
        yield Symptom("massless", "error", f"{text}.", '<inertial><mass value="…"/><inertia ixx="…" …/></inertial>')
    if broken:
        text = f"the principal inertias of {listed(broken)} break the triangle inequality: no body has them, MuJoCo refuses."
        yield Symptom("triangle", "error", text)


def _mimics(root: ET.Element) -> Iterator[Symptom]:
    mimics = [j for j in root.findall("joint") if j.find("mimic") is not None]
    if not mimics:
        return
    text = (
        f"{listed([_name(j) for j in mimics])} mimics a joint: MuJoCo makes it an equality with its default softness, which does "
        "not converge; in Pinocchio (mimic=True) aba, computeMinverse, derivatives and loop constraints raise; without, it moves "
        "freely. A gear of three joints (planetary, differential) cannot be said in URDF."
    )
    yield Symptom("mimic", "warning", text)


def _tensor(inertial: ET.Element | None) -> np.ndarray | None:
    e = None if inertial is None else inertial.find("inertia")
    if e is None:
        return None
    xx, yy, zz, xy, xz, yz = (_value(e, k) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _value(e: ET.Element | None, key: str) -> float:
    found = None if e is None else floats(e, key, 1)
    return 0.0 if found is None else found[0]


def _child(joint: ET.Element) -> str:
    e = joint.find("child")
    return "" if e is None else e.get("link", "")


def _has_range(joint: ET.Element) -> bool:
    limit = joint.find("limit")
    return limit is not None and _value(limit, "lower") < _value(limit, "upper")


def _name(e: ET.Element) -> str:
    return e.get("name") or "a joint"
