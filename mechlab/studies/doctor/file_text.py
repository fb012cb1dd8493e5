"""Findings in the text of a file: what a URDF cannot express, compiler settings of an MJCF, what other readers drop
from it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator

import numpy as np

from mechlab.experiment.recording import Symptom
from mechlab.formats.xml_text import floats
from mechlab.tables import listed

POINT = 1e-15
"""Largest principal inertia [kg m^2] that is none; MuJoCo's smallest."""
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
    empty, broken, points = [], [], []
    for link in root.findall("link"):
        name, inertial = link.get("name") or "?", link.find("inertial")
        mass = 0.0 if inertial is None else _value(inertial.find("mass"), "value")
        tensor = _tensor(inertial)
        if mass <= 0.0 and carried.get(name) in MOVING:
            empty.append((name, name in below))
        if tensor is not None and mass > 0.0:
            a, b, c = np.linalg.eigvalsh(tensor)
            if c < POINT and carried.get(name) in MOVING:
                points.append(name)
            elif a < 0.0 or a + b < c * (1 - 1e-6):
                broken.append(f"{name} ({a:.3g}, {b:.3g}, {c:.3g})")
    if empty:
        leaf = [n for n, parent in empty if not parent]
        text = f"{listed([n for n, _ in empty])} moves and has no mass: MuJoCo refuses it"
        text += f"; {listed(leaf)} carries nothing either, the mass matrix is singular" if leaf else ""
        yield Symptom("massless", "error", f"{text}.", '<inertial><mass value="…"/><inertia ixx="…" …/></inertial>')
    if points:
        text = f"{listed(points)} moves and has a mass but no inertia: a point, whose rotation MuJoCo refuses."
        yield Symptom("massless", "error", text, '<inertia ixx="…" iyy="…" izz="…" ixy="0" ixz="0" iyz="0"/>')
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


def compiler(root: ET.Element) -> dict[str, str]:
    """The attributes of all <compiler> elements; a later one counts."""
    merged: dict[str, str] = {}
    for element in root.iter("compiler"):
        merged |= element.attrib
    return merged


def compiler_settings(root: ET.Element) -> Iterator[Symptom]:
    """Finding "masses_changed" of the <compiler> element."""
    merged = compiler(root)
    changing = [k for k in ("boundmass", "boundinertia") if _number(merged.get(k)) > 0]
    changing += ["balanceinertia"] if merged.get("balanceinertia") == "true" else []
    if changing:
        text = f"the compiler changes masses or inertias ({', '.join(changing)}): the engine's model is not what the file says."
        yield Symptom("masses_changed", "warning", text)
    total = _number(merged.get("settotalmass"))
    if total > 0:
        text = f"the compiler scales all masses and inertias to a total of {total:g} kg: those in the file are not those of a run."
        yield Symptom("masses_changed", "note", text, number=total)
    if merged.get("inertiafromgeom") == "true" and root.find(".//inertial") is not None:
        text = "inertiafromgeom is true: every <inertial> of the file is ignored."
        yield Symptom("masses_changed", "warning", text, '<compiler inertiafromgeom="auto"/>')


def _number(value: str | None) -> float:
    try:
        return float(value or 0.0)
    except ValueError:
        return 0.0


def other_readers(root: ET.Element) -> Iterator[Symptom]:
    """Finding "pinocchio_reader": what pinocchio.buildModelFromMJCF would drop of this MJCF."""
    lost = list(_lost(root))
    if lost:
        text = f"pinocchio.buildModelFromMJCF (4.1.0) would silently lose {listed(lost, 8)}."
        yield Symptom("pinocchio_reader", "note", text)


def _lost(root: ET.Element) -> Iterator[str]:
    bodies = root.findall("./worldbody/body")
    if len(bodies) > 1:
        yield f"every body of the world but the first ({len(bodies) - 1} trees)"
    if any(e.get("pos", "0 0 0").split() != ["0", "0", "0"] or e.get("quat") for e in bodies[:1]):
        yield "the pose of the root body"
    for option in root.findall("option"):
        gravity = floats(option, "gravity", 3)
        if gravity is not None and gravity != (0.0, 0.0, -9.81):
            yield f"gravity {option.get('gravity')}"
    couplings = [e for section in root.findall("equality") for e in section if e.tag in ("joint", "tendon")]
    if couplings:
        yield f"{len(couplings)} joint and tendon equalities (gears, mimics)"
    if root.find(".//worldbody//frame") is not None or root.find(".//worldbody//replicate") is not None:
        yield "what stands in <frame> and <replicate>"
