"""Model files, each reloaded by its consumer before it is handed out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mechlab.engines.mujoco.model_file.written import FileTrial, try_file
from mechlab.engines.protocol import available, engine
from mechlab.errors import EngineMissing, MechlabError
from mechlab.experiment.scene import Settings
from mechlab.formats import from_json, urdf_map, write_files
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import row_units


@dataclass(frozen=True)
class Written:
    """The files by kind, the result of a short run of the MJCF in plain MuJoCo, and the curves of the mechanism."""

    files: dict[str, Path]
    trial: FileTrial
    curves: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """What was done with the files before they were handed out."""
        done = "every file was reloaded by its consumer (MuJoCo, Pinocchio, yourdfpy)"
        if self.curves:
            done += f"; {', '.join(self.curves)}: the MJCF holds it near the reference pose (degree 4), the URDF not, the JSON wholly"
        if self.trial.exit_code:
            return f"{done}, but the MJCF does not come through a trial run in plain MuJoCo"
        return f"{done}; the MJCF came through a trial run in plain MuJoCo"


def write_verified(mechanism: Mechanism, out: str | Path, settings: Settings | None = None) -> Written:
    """Write the files of a mechanism into `out`; nothing is left behind when one is refused.

    settings: timestep, integrator and hardness that the MJCF file says (default: the preset accurate). Where plain MuJoCo
    does not complete a short run of the file with them, the file says others; see
    `mechlab.engines.mujoco.model_file.written`.

    Raises MechlabError naming the file and its consumer.
    """

    trial = try_file(mechanism, settings)
    written = write_files(mechanism, Path(out), trial.settings, verify=lambda folder, again: _reloaded(mechanism, folder, again))
    folders = {kind.partition("/")[0]: path for kind, path in written.items()}
    return Written({kind: path.parent if kind == "meshes" else path for kind, path in folders.items()}, trial,
                   tuple(x.name for x in mechanism.curves))  # fmt: skip


def verify(mechanism: Mechanism, folder: Path) -> dict[str, Any]:
    """Reload every file by its consumer and compare with the Mechanism; returns what was compared.

    JSON reads back equal; MuJoCo compiles NAME.xml and scene.xml and agrees in mass and mobility; Pinocchio reads the
    URDF and the sidecar and agrees in the closure; yourdfpy loads the URDF. Raises MechlabError for the first that fails.
    """
    name = mechanism.name
    again = from_json((folder / f"{name}.json").read_text())
    if again != mechanism:
        raise MechlabError(f"{name}.json does not read back as the same mechanism.")
    return {"json": "equal"} | _reloaded(mechanism, folder, again)


def _reloaded(mechanism: Mechanism, folder: Path, again: Mechanism) -> dict[str, Any]:
    """What MuJoCo, Pinocchio and yourdfpy find in the files; `again`: the mechanism that the JSON reads back as."""
    return _mujoco(mechanism, folder) | _pinocchio(mechanism, folder, again) | _yourdfpy(mechanism, folder)


def _mujoco(m: Mechanism, folder: Path) -> dict[str, Any]:
    masses = {}
    for file in (f"{m.name}.xml", "scene.xml"):
        masses[file] = engine("mujoco").file_size(folder / file)[0]
        if abs(masses[file] - m.total_mass) > 1e-12 * max(1.0, m.total_mass):
            raise MechlabError(f"{file}: MuJoCo finds {masses[file]:.9g} kg, the mechanism has {m.total_mass:.9g} kg.")
    return {"mujoco": masses}


def _pinocchio(m: Mechanism, folder: Path, again: Mechanism) -> dict[str, Any]:
    if available("pinocchio"):
        return {"pinocchio": "not installed"}
    mass, nv = engine("pinocchio").file_size(folder / f"{m.name}.urdf")
    moving = sum(b.inertia.mass for b in m.bodies)
    if abs(mass - moving) > 1e-12 * max(1.0, moving) and not _welded_to_ground(m):
        raise MechlabError(f"{m.name}.urdf: Pinocchio finds {mass:.9g} kg, the mechanism has {moving:.9g} kg.")
    try:
        state = engine("pinocchio").state(again, again.reference())
    except EngineMissing:  # too large for Pinocchio's workspace; it has read the file
        return {"pinocchio": {"nv": nv}}
    residual = state.residual / row_units(again, ConstraintSet(again))
    gap = float(np.max(np.abs(residual), initial=0.0))
    if gap > 1e-12:
        raise MechlabError(f"{m.name}.json: open by {gap:.3g} of its size in Pinocchio, expected 1e-12.")
    return {"pinocchio": {"nv": nv, "gap": gap}}


def _welded_to_ground(m: Mechanism) -> bool:
    """Bodies without a joint on the ground belong to the universe in Pinocchio, which drops their mass."""
    return any(not b.joints for b in m.bodies)


def _yourdfpy(m: Mechanism, folder: Path) -> dict[str, Any]:
    import yourdfpy

    robot = yourdfpy.URDF.load(str(folder / f"{m.name}.urdf"), load_meshes=False, build_scene_graph=True)
    written = urdf_map(m).bodies
    links = {b.name: written[b.name] for b in m.bodies}
    missing = set(links.values()) - set(robot.link_map)
    if missing:
        raise MechlabError(f"{m.name}.urdf: yourdfpy does not find the links {', '.join(sorted(missing))}.")
    tree = TreeKinematics(m)
    above = {j.child: j.parent for j in robot.joint_map.values()}
    pose = {robot.base_link: np.eye(4)}  # link by link: its own product over a path costs the cube of its length

    def world(link: str) -> Array:
        path = []
        while link not in pose:
            path.append(link)
            link = above[link]
        for child in reversed(path):
            pose[child] = pose[above[child]] @ robot.get_transform(child, above[child])
        return pose[path[0] if path else link]

    worst = max((float(np.abs(world(link) - tree.matrix(name)).max()) for name, link in sorted(links.items())), default=0.0)
    if worst > 1e-9 * m.length_scale:
        raise MechlabError(f"{m.name}.urdf: a link stands {worst:.3g} off in yourdfpy.")
    return {"yourdfpy": {"links": len(robot.link_map), "difference": worst}}
