"""Our own JSON beside a URDF: the URDF is the tree of the mechanism in it, the JSON is all of it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.formats.mechanism_json import FORMAT, from_json
from mechlab.formats.model_text import read_text
from mechlab.formats.urdf import to_urdf
from mechlab.formats.xml_text import parse
from mechlab.mechanism.model import Mechanism


def whole_from_sidecar(path: Path, content: str) -> tuple[Mechanism, str] | None:
    """The Mechanism of the NAME.json of mechlab beside NAME.urdf and a sentence that says so; None where there is none.

    A URDF that was changed since is another mechanism than its JSON: raises MechlabError that says which to keep.
    """
    file = path.with_suffix(".json")
    if not file.is_file() or FORMAT not in (text := read_text(file)):
        return None
    try:
        mechanism = from_json(text)
    except MechlabError as error:
        raise MechlabError(f"{file.name} beside it cannot be read: {error}") from None
    if _tree(to_urdf(mechanism)) != _tree(content):
        raise MechlabError(
            f"{file.name} beside it says another mechanism than this URDF: one of the two was changed. Load {file.name} for the "
            "mechanism with its loops and gears; to use the changed URDF alone, move it to another folder or name."
        )
    parts = [f"{len(x)} {what}" for what, x in (
        ("loops", mechanism.loops), ("relations", mechanism.relations), ("curves", mechanism.curves), ("shafts", mechanism.shafts),
        ("springs", mechanism.springs), ("drives", mechanism.drives),
    ) if x]  # fmt: skip
    return mechanism, f"read whole from {file.name} beside it ({', '.join(parts)})" if parts else ""


def _tree(content: str) -> str:
    """The text of a URDF without what is drawn."""
    root = parse(content, "robot", "URDF file")
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    return ET.canonicalize(ET.tostring(root, encoding="unicode"), strip_text=True)
