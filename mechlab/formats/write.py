"""The files of a mechanism in a folder: NAME.xml, scene.xml, NAME.urdf, NAME.json and the meshes. All of them or none.

Everything is written into a temporary folder and read back there; only then it is moved into place
(`mechlab.files.whole_folder`). Other files of the folder stay as they are.
"""

from __future__ import annotations

import hashlib
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.experiment.settings import Settings
from mechlab.files import whole_folder, write
from mechlab.formats.mechanism_json import from_json, to_json
from mechlab.formats.mjcf import to_mjcf
from mechlab.formats.mjcf_scene import scene_mjcf
from mechlab.formats.solids import primitive
from mechlab.formats.urdf import to_urdf, urdf_map
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.shape import Shape

MESHES = "meshes"
Verify = Callable[[Path, Mechanism], None]


def write_files(
    m: Mechanism, out_dir: str | Path, settings: Settings | None = None, verify: Verify | None = None
) -> dict[str, Path]:
    """Write the files of a mechanism into `out_dir`, which is made if it does not exist; returns label -> path.

    Labels: "mjcf", "scene", "urdf", "json", and "meshes/FILE" for each mesh. `verify(folder, mechanism)` may reload
    the files by their consumers and raise before anything is moved into place. Raises MechlabError when the folder
    cannot be written.
    """
    out = Path(out_dir)
    with whole_folder(out) as stage:
        names = _write(m, stage, settings)
        check_texts(stage, m)
        if verify is not None:
            verify(stage, m)
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
    """Write one OBJ for each different solid that is no primitive; returns shape -> file, relative to `folder`."""
    from mechlab.shapes import mesh, write_obj

    shapes = [*m.ground_shapes, *(s for b in m.bodies for s in b.shapes), *(s for x in m.shafts for s in x.shapes)]
    wanted = [s for s in shapes if primitive(s) is None]
    if wanted:
        (folder / MESHES).mkdir(exist_ok=True)
    files: dict[Shape, str] = {}
    for item in wanted:
        key = hashlib.sha256(repr((item.kind, item.size)).encode()).hexdigest()[:8]
        file = f"{MESHES}/{item.kind}_{key}.obj"
        files[item] = file
        if not (folder / file).exists():
            write_obj(mesh(item.kind, item.parameters), folder / file)
    return files


def check_texts(folder: Path, m: Mechanism) -> None:
    """Read the written texts back: the XML parses, the files it names exist, the JSON is the same mechanism."""
    for name in (f"{m.name}.xml", "scene.xml", f"{m.name}.urdf"):
        root = ET.fromstring((folder / name).read_text("utf-8"))
        for element in root.iter():
            file = element.get("file") or element.get("filename")
            if file is not None and not (folder / file).is_file():
                raise MechlabError(f"{name} names the file {file!r}, which was not written.")
    if from_json((folder / f"{m.name}.json").read_text("utf-8")) != m:
        raise MechlabError(f"{m.name}.json does not read back as the same mechanism; please report this.")
