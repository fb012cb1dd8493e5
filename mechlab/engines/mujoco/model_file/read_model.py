"""Anybody's MJCF file -> Mechanism, from the model as MuJoCo compiles it: with includes, defaults, replicated parts, frames,
meshes as inertia, and everything that the compiler derives (damping ratios, inherited ranges, bounds on masses).

Read: bodies, hinge, slide, ball and free joints, connect, weld, joint and tendon equalities with linear polynomials, fixed
tendons, tendons between two sites, and actuators whose force is linear in control, length and rate. Everything else is named
in `left_out`. What counts as lost acts on the motion without contacts; see `ModelFile.lost`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import OBJECT, Remarks, compiled, key
from mechlab.engines.mujoco.model_file.missing_meshes import load_model
from mechlab.engines.mujoco.model_file.read_actuators import read_actuators
from mechlab.engines.mujoco.model_file.read_loops import read_equalities
from mechlab.engines.mujoco.model_file.read_rest import read_rest
from mechlab.engines.mujoco.model_file.read_tendons import read_tendons
from mechlab.engines.mujoco.model_file.read_tree import CompiledTree, read_tree, switched_off, vector
from mechlab.errors import MechlabError
from mechlab.experiment.model_file import ModelFile
from mechlab.formats.mjcf.read import from_mjcf
from mechlab.formats.mjcf.source import Names, clean, written_by_mechlab
from mechlab.mechanism.assembly import assembled_pose, rebased
from mechlab.mechanism.builder import Builder
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array, quaternion_product
from mechlab.mechanism.kinematics import TreeKinematics, integrate
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.naming import colliding_frame
from mechlab.mechanism.parts import MAX_ROWS, MAX_SHAPES, Frame
from mechlab.mechanism.tree import depth_first, too_many_shapes
from mechlab.mechanism.validate import RecordedTree

CLOSED = 1e-12
"""Largest gap of a loop [m, rad] that is rounding."""


def read_mjcf_file(path: Path, content: str) -> ModelFile:
    """An MJCF file whose text is `content`: read from its text if mechlab wrote it, or else from the model that MuJoCo makes of
    it. Raises MechlabError with MuJoCo's words where it refuses the file; see also `missing_meshes`."""
    if written_by_mechlab(content):
        return own_file(from_mjcf(content), path)
    model, note = load_model(path, content)
    file = from_compiled(model, path)
    return replace(file, notes=(note, *file.notes)) if note else file


def own_file(mechanism: Mechanism, path: Path) -> ModelFile:
    """A file that mechlab wrote: all names are those of the mechanism."""
    closures = [*(x.name for x in mechanism.loops), *(x.name for x in mechanism.couplings)]
    curves = ", ".join(x.name for x in mechanism.curves)
    told = f"{curves}: the file holds polynomials of degree 4, right near its reference pose; the JSON beside it holds the whole curves."
    tendons = [x.name for x in mechanism.shafts] + [x.name for x in mechanism.springs]
    return ModelFile(
        path, "MJCF", mechanism, notes=(told,) if curves else (),
        joints={j.name: (j.name,) for j in mechanism.joints},
        bodies={b.name: b.name for b in mechanism.bodies},
        drives={d.name: d.name for d in mechanism.drives},
        closures={name: name for name in closures},
        tendons={name: name for name in tendons},
        ours=True,
    )  # fmt: skip


def read_model(path: Path) -> ModelFile:
    """The mechanism of an MJCF file. Raises MechlabError where MuJoCo refuses the file, and as `from_compiled`."""
    return from_compiled(compiled(path), path)


def from_compiled(model: mujoco.MjModel, path: Path | None = None) -> ModelFile:
    """The mechanism of a compiled model, which is not changed; where no Mechanism holds it, `unheld` says why. Raises MechlabError
    for a model without joints, with more than MAX_SHAPES geoms, or unheld and with more than MAX_ROWS coordinates."""
    if not model.nv:
        raise MechlabError("nothing moves in this model: it has no joints.")
    if model.ngeom > MAX_SHAPES:
        raise too_many_shapes(_name(model), model.ngeom)
    remarks = Remarks()
    tree = read_tree(model, remarks)
    names = Names("equality")
    tendons = read_tendons(tree, names)
    equalities = read_equalities(tree, tendons, names)
    drives, drive_of = read_actuators(tree, tendons)
    read_rest(model, remarks)
    still = switched_off(model, mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    builder = Builder(_name(model), (0.0, 0.0, 0.0) if still else vector(model.opt.gravity))
    builder.bodies, builder.loops, builder.meshes = tree.bodies, equalities.loops, list(equalities.relations)
    builder.curves = equalities.curves
    builder.shafts, builder.springs, builder.drives = (
        list(tendons.shafts.values()),
        list(tendons.springs.values()),
        drives,
    )
    builder.frames, builder.ground_shapes = _frames(tree, builder), tree.ground_shapes
    joints = {key(model, OBJECT.mjOBJ_JOINT, k): names for k, names in tree.joints_of.items()}
    bodies = {key(model, OBJECT.mjOBJ_BODY, k): name for k, name in tree.body_of.items()}
    tree_alone, notes = _recorded(builder), list(remarks.notes)
    try:
        mechanism, moved = _closed(builder, equalities.offsets, remarks)
    except MechlabError as error:
        if model.nv > MAX_ROWS:
            raise
        told = f"no Mechanism holds this file; MuJoCo runs it as it is. The reason: {error}"
        return ModelFile(
            path, "MJCF", tree_alone, notes=(told, *notes), joints=joints, bodies=bodies, unheld=str(error)
        )  # fmt: skip
    return ModelFile(
        path, "MJCF", mechanism, remarks.left_out, tuple(remarks.notes),
        joints, bodies,
        drive_of, equalities.of,
        tendons.of(model),
        _reference(tree, moved) if moved else (),
    )  # fmt: skip


def _name(model: mujoco.MjModel) -> str:
    return clean(bytes(model.names).split(b"\0", 1)[0].decode(errors="replace")) or "model"


def _recorded(builder: Builder) -> RecordedTree:
    """What a run of the file is recorded by where no Mechanism holds it."""
    return RecordedTree(
        builder.name, tuple(depth_first(builder.bodies)), frames=tuple(builder.frames), gravity=builder.gravity,
        ground_shapes=tuple(builder.ground_shapes),
    )  # fmt: skip


def _frames(tree: CompiledTree, builder: Builder) -> list[Frame]:
    scalars = [j.name for b in tree.bodies for j in b.joints if j.nv == 1] + [s.name for s in builder.shafts]
    names = Names("site")
    out = []
    for name, (body, at) in tree.sites.items():
        taken = colliding_frame(name, scalars)
        out.append(Frame(names.add(f"{name}_site" if taken else name), body, at))
    return out


def _closed(builder: Builder, offsets: dict[str, float], remarks: Remarks) -> tuple[Mechanism, dict[str, Array]]:
    """The mechanism with its loops closed, and the coordinates of the joints that moved for it.

    A relation with an offset is met first, by the smallest change of the joints; then Newton closes the loops from there.
    """
    moved: dict[str, Array] = {}
    if offsets:
        m = builder.opened()
        rows = np.array([m.coefficient_row(r.coefficients) for r in m.relations])
        change = np.linalg.lstsq(rows, np.array([offsets.get(r.name, 0.0) for r in m.relations]), rcond=1e-11)[0]
        scalar = np.concatenate([np.full(j.nv, j.nv == 1) for j in m.joints])
        _move(builder, m, integrate(m, m.reference(), change * scalar), moved)
        remarks.notes.append(f"the equalities {', '.join(offsets)} hold an offset: the reference pose meets it.")
    m = builder.opened()
    constraints = ConstraintSet(m)
    if not len(constraints):
        return builder.build(), moved
    residual = constraints.residual(TreeKinematics(m))
    worst = int(np.argmax(np.abs(residual)))
    if np.abs(residual[worst]) > CLOSED:
        _move(builder, m, assembled_pose(m, {}, ()), moved)
        remarks.notes.append(
            f"{constraints.rows[worst]} is open by {abs(residual[worst]):.3g} in the pose of the file: the reference pose is the "
            "nearest closed one."
        )
    return builder.build(), moved


def _move(builder: Builder, m: Mechanism, q: Array, moved: dict[str, Array]) -> None:
    """Make the pose q of the open mechanism `m` the reference pose of the builder; adds its coordinates to `moved`."""
    builder.bodies = [rebased(b, m, q) for b in m.bodies]
    builder.shafts = [replace(s, zero=float(m.value(s.name, q))) for s in builder.shafts]
    for joint in m.joints:
        x = q[m.q_slice[joint.name]]
        moved[joint.name] = x if joint.nv == 3 else moved.get(joint.name, 0.0) + x


def _reference(tree: CompiledTree, moved: dict[str, Array]) -> tuple[float, ...]:
    """The file's coordinates (qpos) of the reference pose."""
    model = tree.model
    out = np.array(model.qpos0)
    for k, names in tree.joints_of.items():
        at = int(model.jnt_qposadr[k])
        parts = [moved[n] for n in names]
        if len(names) == 4:
            out[at : at + 3] += np.concatenate(parts[:3])
            out[at + 3 : at + 7] = quaternion_product(out[at + 3 : at + 7], parts[3])
        elif len(parts[0]) == 4:
            out[at : at + 4] = parts[0]
        else:
            out[at] += parts[0][0]
    return tuple(float(x) for x in out)
