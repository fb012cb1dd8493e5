"""The tree of a compiled MuJoCo model: bodies with their inertias, joints, sites, and geoms as shapes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import OBJECT, Remarks, given_name, key
from mechlab.engines.mujoco.model_file.surfaces import geom_color, is_shown, surface_shape
from mechlab.formats.mjcf.read_tree import BodyTree, PlacedJoint, anchored
from mechlab.formats.mjcf.source import clean
from mechlab.mechanism.geometry import Array, Placement, Vector, quaternion_to_matrix, unit
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.parts import GROUND, Body, Joint, Shape, shape
from mechlab.tables import listed

JOINT, DISABLE = mujoco.mjtJoint, mujoco.mjtDisableBit
KINDS = {JOINT.mjJNT_HINGE: "revolute", JOINT.mjJNT_SLIDE: "prismatic", JOINT.mjJNT_BALL: "spherical"}


def vector(values: Array) -> Vector:
    """Three numbers of an array of the engine."""
    x, y, z = (float(v) for v in values)
    return (x, y, z)


def placement(position: Array, quaternion: Array) -> Placement:
    """A placement from arrays of the engine."""
    w, x, y, z = (float(v) for v in quaternion)
    return Placement(vector(position), (w, x, y, z))


def switched_off(model: mujoco.MjModel, *flags: mujoco.mjtDisableBit) -> bool:
    """True when the file switches one of these parts of the physics off."""
    return any(bool(model.opt.disableflags & flag) for flag in flags)


class CompiledTree(BodyTree):
    """A BodyTree of a compiled model, with the maps from the elements of the file to those of the Mechanism."""

    def __init__(self, model: mujoco.MjModel, remarks: Remarks) -> None:
        super().__init__()
        self.model, self.remarks = model, remarks
        self.body_of: dict[int, str] = {0: GROUND}
        self.joints_of: dict[int, tuple[str, ...]] = {}
        self.place_of: dict[int, Placement] = {0: Placement()}
        """MuJoCo's body frame in the frame of the body of the Mechanism."""


def read_tree(model: mujoco.MjModel, remarks: Remarks) -> CompiledTree:
    """The bodies of a compiled model, with joints, inertias, shapes and sites."""
    tree = CompiledTree(model, remarks)
    tree.body_names.reserve(GROUND)
    for k in range(1, model.nbody):
        _body(tree, k)
    _note_names(tree)
    for k in range(model.ngeom):
        _geom(tree, k)
    for k in range(model.nsite):
        name = given_name(model, OBJECT.mjOBJ_SITE, k)
        if name:
            tree.sites[name] = site_place(tree, k)
    return tree


def _note_names(tree: CompiledTree) -> None:
    """A note on the names that changed: a Mechanism allows letters, digits, '_', '-' and '.'."""
    given = tree.body_names.given | tree.joint_names.given
    changed = [f"{old!r} is {new!r}" for old, new in given.items() if clean(old) != old]
    if changed:
        tree.remarks.notes.append(f"names that changed: {listed(changed)}.")


def site_place(tree: CompiledTree, k: int) -> tuple[str, Placement]:
    """Body of a site, and the site in its frame."""
    body = int(tree.model.site_bodyid[k])
    local = placement(tree.model.site_pos[k], tree.model.site_quat[k])
    return tree.body_of[body], tree.place_of[body] @ local


def _body(tree: CompiledTree, k: int) -> None:
    model = tree.model
    above = int(model.body_parentid[k])
    given = given_name(model, OBJECT.mjOBJ_BODY, k)
    name = tree.body_names.add(given)
    stands = tree.place_of[above] @ placement(model.body_pos[k], model.body_quat[k])
    first = int(model.body_jntadr[k])
    joints = tuple(_joint(tree, j, stands, name) for j in range(first, first + int(model.body_jntnum[k])))
    parent, stands, inner, own = anchored(tree, name, tree.body_of[above], stands, joints)
    tree.body_of[k], tree.place_of[k] = name, inner
    turn = quaternion_to_matrix(model.body_iquat[k])
    t = turn @ np.diag(model.body_inertia[k]) @ turn.T
    mass = float(model.body_mass[k])
    inertia = Inertia()
    if mass:
        moments = (t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2])
        com = vector(model.body_ipos[k] + inner.translation)
        inertia = Inertia(mass, com, tuple(float(x) for x in moments))  # type: ignore[arg-type]
    tree.bodies.append(Body(name, parent, stands, own, inertia))
    if model.body_gravcomp[k]:
        tree.remarks.lose("gravcomp", name, "a force against gravity")
    if model.body_mocapid[k] >= 0:
        tree.remarks.keep("mocap body", name, "it stands still")


def _joint(tree: CompiledTree, k: int, stands: Placement, body: str) -> PlacedJoint:
    model = tree.model
    kind = JOINT(model.jnt_type[k])
    given = given_name(model, OBJECT.mjOBJ_JOINT, k)
    d = int(model.jnt_dofadr[k])
    passive: dict[str, Any] = {
        "damping": 0.0 if switched_off(model, DISABLE.mjDSBL_DAMPER) else float(model.dof_damping[d]),
        "armature": float(model.dof_armature[d]),
        "friction": 0.0
        if switched_off(model, DISABLE.mjDSBL_FRICTIONLOSS, DISABLE.mjDSBL_CONSTRAINT)
        else float(model.dof_frictionloss[d]),
        "stiffness": 0.0 if switched_off(model, DISABLE.mjDSBL_SPRING) else float(model.jnt_stiffness[k]),
    }
    for actuator, gear in actuators_on(model, mujoco.mjtTrn.mjTRN_JOINT, k):
        passive["damping"] += gear**2 * float(model.actuator_damping[actuator])
        passive["armature"] += gear**2 * float(model.actuator_armature[actuator])
    _losses(tree, k)
    if kind == JOINT.mjJNT_FREE:
        name = tree.joint_names.add(given, f"{body}_free")
        joints = free_joints(name, stands, **passive)
        tree.joints_of[k] = tuple(j.name for j in joints)
        return PlacedJoint(joints, (0.0, 0.0, 0.0))
    name = tree.joint_names.add(given, f"joint_{k + 1}")
    tree.joints_of[k] = (name,)
    limits = (float(model.jnt_range[k, 0]), float(model.jnt_range[k, 1]))
    limited = bool(model.jnt_limited[k]) and not switched_off(model, DISABLE.mjDSBL_LIMIT, DISABLE.mjDSBL_CONSTRAINT)
    if limited and limits[0] >= limits[1]:
        tree.remarks.lose("joint range", name, "its ends are one, which holds the joint")
        limited = False
    if kind == JOINT.mjJNT_BALL:
        joint = Joint(name, "spherical", range=limits if limited else None, **passive)
    else:
        q = int(model.jnt_qposadr[k])
        zero, rest = float(model.qpos0[q]), float(model.qpos_spring[q])
        axis = unit(model.jnt_axis[k], f"joint {name!r}: axis")
        joint = Joint(
            name, KINDS[kind], axis, zero, limits if limited else None,
            spring_rest=rest if passive["stiffness"] else 0.0, **passive,
        )  # fmt: skip
        tree.ref[name] = tree.zero[name] = zero
    return PlacedJoint((joint,), vector(model.jnt_pos[k]))


def actuators_on(model: mujoco.MjModel, transmission: mujoco.mjtTrn, number: int) -> list[tuple[int, float]]:
    """(actuator, gear) of the actuators on a joint or tendon."""
    there = (model.actuator_trntype == transmission) & (model.actuator_trnid[:, 0] == number)
    return [(int(k), float(model.actuator_gear[k, 0])) for k in np.flatnonzero(there)]


def free_joints(name: str, stands: Placement, **passive: Any) -> tuple[Joint, ...]:
    """Three slides along the axes of the frame that a free body stands in, and a ball joint: its coordinates are MuJoCo's
    position less that of the reference pose, and the rotation from there."""
    across = stands.rotation.T
    slides = [
        Joint(f"{name}_{letter}", "prismatic", unit(across[:, k], name), **passive) for k, letter in enumerate("xyz")
    ]
    return (*slides, Joint(f"{name}_turn", "spherical", **passive))


def _losses(tree: CompiledTree, k: int) -> None:
    model, name = tree.model, key(tree.model, OBJECT.mjOBJ_JOINT, k)
    d = int(model.jnt_dofadr[k])
    if np.any(model.jnt_stiffnesspoly[k]) or np.any(model.jnt_springyield[k]):
        tree.remarks.lose("joint spring", name, "it is nonlinear")
    if np.any(model.dof_dampingpoly[d]):
        tree.remarks.lose("joint damping", name, "it is nonlinear")


def _geom(tree: CompiledTree, k: int) -> None:
    found = geom_shape(tree.model, k)
    if found is None:
        return
    body = int(tree.model.geom_bodyid[k])
    item = replace(found, placement=tree.place_of[body] @ found.placement)
    if not body:
        tree.ground_shapes.append(item)
        return
    slot = next(i for i, b in enumerate(tree.bodies) if b.name == tree.body_of[body])
    tree.bodies[slot] = replace(tree.bodies[slot], shapes=(*tree.bodies[slot].shapes, item))


def geom_shape(model: mujoco.MjModel, k: int) -> Shape | None:
    """The shape of a geom in the frame of its body; None where MuJoCo's viewers do not show it, and for surfaces without area."""
    if not is_shown(model, k):
        return None
    kind = mujoco.mjtGeom(model.geom_type[k])
    at, s = placement(model.geom_pos[k], model.geom_quat[k]), model.geom_size[k]
    color = geom_color(model, k)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return shape("box", at, color, x=2 * s[0], y=2 * s[1], z=2 * s[2])
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return shape("sphere", at, color, radius=s[0])
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return shape("cylinder", at, color, radius=s[0], length=2 * s[1])
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return shape("rod", at @ Placement((0.0, 0.0, -float(s[1]))), color, radius=s[0], length=2 * s[1])
    return surface_shape(model, k, at)
