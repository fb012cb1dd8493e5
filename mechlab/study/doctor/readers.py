"""What other readers make of the file: Pinocchio's MJCF reader loses parts of it without a word (version 4.1.0)."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator

from mechlab.formats.xml_text import floats
from mechlab.study.doctor.result import Symptom
from mechlab.study.doctor.softness import listed


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
