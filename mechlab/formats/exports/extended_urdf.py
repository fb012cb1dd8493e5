"""A Mechanism as an Extended URDF: the tree as URDF, its loops, motors and ball joints in a YAML file (arXiv 2504.04767).

A fixed loop is a pair of frames of type 6d, a spherical one of type 3d. Any other loop gets a filler link with its joint: a pin is
a revolute joint whose far side is closed by 6d. Gears and other relations of more than two joints, shafts, springs and gravity
have no place in the format.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mechlab.errors import MechlabError, explained
from mechlab.experiment.model_file import LeftOut
from mechlab.files import whole_folder, write
from mechlab.formats.exports.graph import Exported
from mechlab.formats.loops_yaml import extended_yaml
from mechlab.formats.urdf import MASSLESS, to_urdf, unmimicked, urdf_map
from mechlab.formats.write import write_meshes
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Body, Frame, Joint, Loop, Shape
from mechlab.mechanism.tree import depth_first, reference_poses

TYPES = {"fixed": "6d", "spherical": "3d"}
FILLERS: dict[str, tuple[tuple[str, str], ...]] = {
    "revolute": (("revolute", "z"),),
    "prismatic": (("prismatic", "z"),),
    "cylindrical": (("prismatic", "z"), ("revolute", "z")),
    "universal": (("revolute", "x"), ("revolute", "y")),
}
"""Joints of the filler link of a loop, from its end a to its end b."""
FILLER = Inertia(MASSLESS, (0.0, 0.0, 0.0), (MASSLESS, MASSLESS, MASSLESS, 0.0, 0.0, 0.0))
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class ExtendedUrdf:
    """The two texts, which belong together, and what of the mechanism is in neither."""

    urdf: str
    yaml: str
    left_out: tuple[LeftOut, ...] = ()

    def save(self, folder: str | Path) -> dict[str, Path]:
        """Write robot.urdf and robot.yaml into a folder; returns name -> path."""
        out = Path(folder)
        with whole_folder(out) as stage:
            for name, content in self.files.items():
                write(stage / name, content)
        return {name: out / name for name in self.files}

    @property
    def files(self) -> dict[str, str]:
        """Names that readers of the format expect -> the texts."""
        return {"robot.urdf": self.urdf, "robot.yaml": self.yaml}


def write_extended_urdf(m: Mechanism, folder: Path) -> Exported:
    """Write extended_urdf/robot.urdf, robot.yaml and the meshes."""
    home = folder / "extended_urdf"
    home.mkdir(parents=True)
    made = to_extended_urdf(m, write_meshes(m, home))
    for name, content in made.files.items():
        write(home / name, content)
    files = {f"extended {name.removeprefix('robot.')}": Path("extended_urdf", name) for name in made.files}
    return Exported(files, made.left_out)


@explained
def to_extended_urdf(m: Mechanism, mesh_files: Mapping[Shape, str] | None = None) -> ExtendedUrdf:
    """The mechanism as Extended URDF: `urdf` and `yaml`; `.save(folder)` writes robot.urdf and robot.yaml.

    Joint values are coordinates: 0 in the reference pose, so that the zero pose of the URDF is assembled. A ball joint is one
    revolute in the URDF and SPHERICAL in the YAML. `mesh_files`: the file of each shape that has one, relative to it.

    Raises MechlabError for a loop that keeps a distance, which the format cannot say.
    """
    bodies, frames = [_with_revolute_balls(b) for b in m.bodies], list(m.frames)
    drives = tuple(d for d in m.drives if d.on in m.v_slice)
    taken = {b.name for b in bodies} | {f.name for f in frames}
    pairs = []
    for loop in m.loops:
        body_a, placement_a = loop.body_a, loop.placement_a
        if loop.kind not in TYPES:
            body_a, placement_a = _filler(m, loop, bodies, taken)
        first = _frame(frames, taken, loop.name, "A", body_a, placement_a)
        ends = (first, _frame(frames, taken, loop.name, "B", loop.body_b, loop.placement_b))
        pairs.append((*ends, TYPES.get(loop.kind, "6d")))
    tree = replace(
        m, bodies=depth_first(bodies), frames=tuple(frames), loops=(), curves=(), shafts=(), springs=(), drives=drives,
        relations=tuple(r for r in m.relations if len(r.coefficients) == 2),
    )  # fmt: skip
    names = urdf_map(tree)
    moved = [(names.frames[a], names.frames[b], kind) for a, b, kind in pairs]
    swaps = {names.joints[j.name][0]: "SPHERICAL" for j in m.joints if j.kind == "spherical"}
    motors = [names.joints[d.on][0] for d in drives]
    return ExtendedUrdf(to_urdf(tree, mesh_files), extended_yaml(moved, motors, swaps), _left_out(m))


def _with_revolute_balls(body: Body) -> Body:
    """The body with each ball joint as one revolute, which the YAML swaps back."""
    joints = [replace(j, kind="revolute", axis=AXES["z"]) if j.kind == "spherical" else j for j in body.joints]
    return replace(body, joints=tuple(joints))


def _filler(m: Mechanism, loop: Loop, bodies: list[Body], taken: set[str]) -> tuple[str, Placement]:
    """Add massless links with the joints of the loop at its end a; returns the last one and where end b lies in it."""
    if loop.kind not in FILLERS:
        raise MechlabError(
            f"loop {loop.name!r} keeps a distance, for which an Extended URDF has no word. Write it as a rod: a body with a "
            "universal joint at one end and a spherical loop at the other."
        )
    poses = reference_poses(m.bodies)
    body_a, body_b = (Placement.of(*poses[b]) for b in (loop.body_a, loop.body_b))
    start, end = body_a @ loop.placement_a, body_b @ loop.placement_b
    if loop.kind == "universal":  # the second pin lies along y of end b
        x, y = start.rotation[:, 0], end.rotation[:, 1]
        start = Placement.of(np.column_stack([x, y, np.cross(x, y)]), start.translation)
    parent, placement = loop.body_a, body_a.inverse() @ start
    steps = FILLERS[loop.kind]
    for k, (kind, axis) in enumerate(steps):
        name = f"{loop.name}__{'turn' if kind == 'revolute' else 'slide'}{k + 1 if len(steps) > 1 else ''}"
        if name in taken:
            raise MechlabError(f"the URDF needs a link {name!r} for the loop {loop.name!r}, but a part has that name; rename the part.")
        taken.add(name)
        bodies.append(Body(name, parent, placement, (Joint(name, kind, AXES[axis]),), FILLER))
        parent, placement = name, IDENTITY
    return parent, start.inverse() @ end


def _frame(frames: list[Frame], taken: set[str], loop: str, side: str, body: str, placement: Placement) -> str:
    """The name of a frame there: one that exists, or a new one LOOP_A, LOOP_B."""
    for frame in frames:
        if frame.body == body and frame.placement == placement and frame.name.startswith(loop):
            return frame.name
    name = f"{loop}_{side}"
    while name in taken:
        name += "_"
    taken.add(name)
    frames.append(Frame(name, body, placement))
    return name


def _left_out(m: Mechanism) -> tuple[LeftOut, ...]:
    names: dict[str, Sequence[str]] = {
        "relation of more than two joints": unmimicked(m),
        "curve": [x.name for x in m.curves],
        "shaft": [s.name for s in m.shafts],
        "spring": [s.name for s in m.springs] + [j.name for j in m.joints if j.stiffness],
    }
    return tuple(LeftOut(what, tuple(n), "an Extended URDF has no place for it") for what, n in names.items() if n)
