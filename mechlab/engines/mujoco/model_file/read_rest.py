"""What a compiled MuJoCo model has besides its mechanism: contacts, drawings, sensors, keyframes, fluids. Named, not read."""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import OBJECT, Remarks, key
from mechlab.engines.mujoco.model_file.read_tree import geom_shape, switched_off
from mechlab.engines.mujoco.model_file.surfaces import is_shown
from mechlab.experiment.model_file import unnamed
from mechlab.shapes.surface import MOST_FACES

DISABLE, GEOM = mujoco.mjtDisableBit, mujoco.mjtGeom


def read_rest(model: mujoco.MjModel, remarks: Remarks) -> None:
    """Name everything in a model that its mechanism does not hold."""
    _fluid(model, remarks)
    for k in range(model.nflex):
        remarks.lose("flex", key(model, OBJECT.mjOBJ_FLEX, k), "a deformable body")
    for k in range(model.nplugin):
        remarks.lose("plugin", key(model, OBJECT.mjOBJ_PLUGIN, k), "code outside the file")
    _contacts(model, remarks)
    _drawn(model, remarks)
    for what, kind, count in (
        ("sensor", OBJECT.mjOBJ_SENSOR, model.nsensor),
        ("keyframe", OBJECT.mjOBJ_KEY, model.nkey),
        ("camera", OBJECT.mjOBJ_CAMERA, model.ncam),
        ("light", OBJECT.mjOBJ_LIGHT, model.nlight),
        ("material", OBJECT.mjOBJ_MATERIAL, model.nmat),
        ("texture", OBJECT.mjOBJ_TEXTURE, model.ntex),
        ("skin", OBJECT.mjOBJ_SKIN, model.nskin),
    ):
        for k in range(count):
            remarks.keep(what, key(model, kind, k))


def _fluid(model: mujoco.MjModel, remarks: Remarks) -> None:
    for name in ("density", "viscosity"):
        if getattr(model.opt, name) > 0.0:
            remarks.lose("fluid", name, "forces of a medium on the bodies")


def _contacts(model: mujoco.MjModel, remarks: Remarks) -> None:
    geoms, pairs = may_touch(model)
    for k in geoms:
        remarks.keep("contact", _geom_name(model, k), "here parts pass through each other")
    for k in pairs:
        remarks.keep("contact pair", key(model, OBJECT.mjOBJ_PAIR, k), "here parts pass through each other")
    for k in range(model.nexclude):
        remarks.keep("exclude", key(model, OBJECT.mjOBJ_EXCLUDE, k), "of contacts")


def may_touch(model: mujoco.MjModel) -> tuple[list[int], list[int]]:
    """Geoms whose bits meet those of a geom that is not welded to theirs, and explicit pairs; none where the file switches contacts
    off. It is decided once for geoms of the same bits and body."""
    if switched_off(model, DISABLE.mjDSBL_CONTACT, DISABLE.mjDSBL_CONSTRAINT):
        return [], []
    columns = (model.geom_contype, model.geom_conaffinity, model.body_weldid[model.geom_bodyid])
    kinds, kind_of = np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)
    types, affinities, bodies = kinds.T
    touches = [
        bool(np.any((((types & affinity) | (affinities & bits)) != 0) & (bodies != body)))
        for bits, affinity, body in kinds.tolist()
    ]
    return [k for k, kind in enumerate(kind_of.ravel().tolist()) if touches[kind]], list(range(model.npair))


def _geom_name(model: mujoco.MjModel, k: int) -> str:
    """Name of a geom, or its number and its body."""
    name = key(model, OBJECT.mjOBJ_GEOM, k)
    if name != unnamed(k):
        return name
    return f"{name} of {key(model, OBJECT.mjOBJ_BODY, int(model.geom_bodyid[k]))}"


def _drawn(model: mujoco.MjModel, remarks: Remarks) -> None:
    """Geoms that are not drawn: those that MuJoCo's viewers do not show either are named as such."""
    for k in range(model.ngeom):
        if geom_shape(model, k) is None:
            kind = GEOM(model.geom_type[k]).name.removeprefix("mjGEOM_").lower()
            why = "not drawn here" if is_shown(model, k) else "of a group that is not shown"
            remarks.keep(f"{kind} geom", _geom_name(model, k), why)
    for k in range(model.nmesh):
        if model.mesh_facenum[k] > MOST_FACES:
            remarks.keep("fine mesh", key(model, OBJECT.mjOBJ_MESH, k), f"drawn with at most {MOST_FACES} of its faces")
