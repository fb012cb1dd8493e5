"""The files of a mechanism in a folder: NAME.xml, scene.xml, NAME.urdf, NAME.json and the meshes; all of them or none.

Everything is written into a temporary folder and read back there; only then it is moved into place
(`mechlab.files.whole_folder`). Other files of the folder stay as they are.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.experiment.scene import Settings
from mechlab.files import whole_folder, write
from mechlab.formats.mechanism_json import from_json, to_json
from mechlab.formats.mjcf.write import scene_mjcf, to_mjcf
from mechlab.formats.urdf import to_urdf, urdf_map
from mechlab.formats.xml_text import primitive
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import FLOOR, GROUND, Shape

MESHES = "meshes"
SAME_SIZE = 1e-9
"""Relative difference of sizes below which two solids share a mesh: the digits that an OBJ holds."""
Verify = Callable[[Path, Mechanism], object]


def write_files(
    m: Mechanism, out_dir: str | Path, settings: Settings | None = None, verify: Verify | None = None
) -> dict[str, Path]:
    """Write the files of a mechanism into `out_dir`, which is made if it does not exist; returns label -> path.

    Labels: "mjcf", "scene", "urdf", "json", and "meshes/FILE" for each mesh. `verify(folder, read)` may reload the files by their
    consumers and raise before anything is moved into place; read: the mechanism that the JSON reads back as. Raises MechlabError when
    the folder cannot be written.
    """
    out = Path(out_dir)
    with whole_folder(out) as stage:
        names = _write(m, stage, settings)
        again = check_texts(stage, m)
        if verify is not None:
            verify(stage, again)
    return {label: out / name for label, name in names.items()}


def _write(m: Mechanism, folder: Path, settings: Settings | None) -> dict[str, str]:
    meshes = write_meshes(m, folder)
    texts = {
        f"{m.name}.xml": to_mjcf(m, settings, mesh_files=meshes),
        "scene.xml": scene_mjcf(m),
        f"{m.name}.urdf": to_urdf(m, meshes),
        f"{m.name}.json": to_json(m, {"urdf": urdf_map(m).to_dict(m)}),
    }
    if len(texts) < 4:
        raise MechlabError(f"a mechanism cannot be called {m.name!r}: scene.xml is the name of another file.")
    for name, content in texts.items():
        write(folder / name, content)
    labels = dict(zip(("mjcf", "scene", "urdf", "json"), texts, strict=True))
    return labels | {f: f for f in sorted(set(meshes.values()))}


def write_meshes(m: Mechanism, folder: Path) -> dict[Shape, str]:
    """Write one OBJ for each different solid that is neither a primitive nor a floor; returns shape -> file, relative to `folder`.

    A file is called after the kind of solid and the first body or shaft that has it. Sizes within `SAME_SIZE` of each
    other are one solid, so that file names and sharing do not depend on the last bits of computed sizes, which differ
    between processors.
    """
    from mechlab.shapes import mesh, write_obj

    owned = [(GROUND, s) for s in m.ground_shapes]
    owned += [(b.name, s) for b in m.bodies for s in b.shapes]
    owned += [(x.name, s) for x in m.shafts for s in x.shapes]
    files: dict[Shape, str] = {}
    written: list[tuple[Shape, str]] = []
    for owner, item in owned:
        if primitive(item) is not None or item.kind == FLOOR:
            continue
        file = next((f for other, f in written if _same_solid(item, other)), None)
        if file is None:
            (folder / MESHES).mkdir(exist_ok=True)
            file = _free_name(f"{MESHES}/{item.kind}_{owner}", [f for _, f in written])
            write_obj(mesh(item.kind, item.parameters, item.data), folder / file)
            written.append((item, file))
        files[item] = file
    return files


def _same_solid(a: Shape, b: Shape) -> bool:
    """True for two shapes of one kind whose sizes are equal to within SAME_SIZE."""
    if a.kind != b.kind or a.data != b.data or a.parameters.keys() != b.parameters.keys():
        return False
    scale = max((abs(x) for x in a.parameters.values()), default=0.0)
    return all(abs(x - b.parameters[k]) <= SAME_SIZE * scale for k, x in a.parameters.items())


def _free_name(stem: str, taken: Sequence[str]) -> str:
    """stem.obj, or stem_2.obj and so on, unique without regard to case; ASCII, for every file system."""
    stem = re.sub(r"[^A-Za-z0-9_./-]", "_", stem)
    folded = {f.lower() for f in taken}
    names = (f"{stem}{end}.obj" for end in ("", *(f"_{k}" for k in range(2, len(folded) + 3))))
    return next(n for n in names if n.lower() not in folded)


def check_texts(folder: Path, m: Mechanism) -> Mechanism:
    """Read the written texts back: the XML parses, the files it names exist, the JSON is the same mechanism, which is returned."""
    for name in (f"{m.name}.xml", "scene.xml", f"{m.name}.urdf"):
        root = ET.fromstring((folder / name).read_text("utf-8"))
        for element in root.iter():
            file = element.get("file") or element.get("filename")
            if file is not None and not (folder / file).is_file():
                raise MechlabError(f"{name} names the file {file!r}, which was not written.")
    again = from_json((folder / f"{m.name}.json").read_text("utf-8"))
    if again != m:
        raise MechlabError(f"{m.name}.json does not read back as the same mechanism; please report this.")
    return again
