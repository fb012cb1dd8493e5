"""Local freedoms of a MuJoCo model: bodies that can move while everything else stands still, such as a rod that spins between two balls.

    J_b u = 0,    u rates of the joints of one body (or of bodies that turn about one common point), J_b their columns of the rows

They count as freedoms, but no loop moves by them, no actuator reaches them, and nothing but damping holds them.
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from mechlab.mechanism.geometry import Array

ZERO = 1e-7
"""A singular value of the columns of a body, over the largest, below which its motion breaks no row."""
SAME = 1e-9
"""Distance of two joints, over the size of the model, below which they are one ball."""


def local_freedoms(model: mujoco.MjModel, data: mujoco.MjData, jacobian: Array, size: float) -> Iterator[tuple[str, int]]:
    """(name of the body, number of its local freedoms); data: the pose of the jacobian (rows, nv), a general one."""
    if not len(jacobian):
        return
    balls = _balls(model, data, SAME * size)
    held = _held(model)
    for bodies in balls:
        dofs = _dofs(model, bodies)
        below = [other for other in balls if _parent_with_joints(model, other[-1]) in bodies]
        if held & set(dofs) or len(below) > 1 or not _turns(model, data, bodies, SAME * size):
            continue
        if below:  # a rod between two balls of the tree: it spins while the body at its end stands still
            free = _still(model, data, jacobian, dofs + _dofs(model, below[0]), below[0][0])
        else:
            free = len(_null(jacobian[:, dofs]))
            free = free if len(dofs) <= 3 or free == 1 else 0  # a free body on one pin is a pendulum
        if free:
            yield mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, bodies[0]) or f"body number {bodies[0]}", free


def _turns(model: mujoco.MjModel, data: mujoco.MjData, bodies: list[int], near: float) -> bool:
    """Whether these bodies only turn about one point, in two ways at least, or float freely."""
    kinds = [int(model.jnt_type[j]) for b in bodies for j in range(model.body_jntadr[b], model.body_jntadr[b] + model.body_jntnum[b])]
    if kinds == [int(mujoco.mjtJoint.mjJNT_FREE)]:
        return True
    if {int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_FREE)} & set(kinds) or len(_dofs(model, bodies)) < 2:
        return False
    return float(np.ptp(np.vstack([_anchors(model, data, b) for b in bodies]), axis=0).max()) < near


def _null(columns: Array) -> Array:
    """(n, columns) motions that break no row; none for columns that no row feels."""
    _, values, rows = np.linalg.svd(columns)
    if not len(values) or values[0] == 0.0:
        return np.zeros((0, columns.shape[1]))
    return np.asarray(rows[int(np.sum(values > ZERO * values[0])) :])


def _still(model: mujoco.MjModel, data: mujoco.MjData, jacobian: Array, dofs: list[int], body: int) -> int:
    """The number of free motions of these degrees of freedom under which a body does not move."""
    motions = _null(jacobian[:, dofs])
    if not len(motions):
        return 0
    moved = np.zeros((len(motions), 6))
    turning, going = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacBody(model, data, going, turning, body)
    for k, u in enumerate(motions):
        rates = np.zeros(model.nv)
        rates[dofs] = u
        moved[k] = np.concatenate([turning @ rates, going @ rates])
    return len(motions) - int(np.linalg.matrix_rank(moved, tol=ZERO))


def _balls(model: mujoco.MjModel, data: mujoco.MjData, near: float) -> list[list[int]]:
    """Bodies with joints, those together that turn about one point; each the lowest first."""
    done: set[int] = set()
    out = []
    for b in range(model.nbody - 1, 0, -1):
        if b not in done and model.body_jntnum[b]:
            out.append(_one_ball(model, data, b, near))
            done |= set(out[-1])
    return out


def _dofs(model: mujoco.MjModel, bodies: list[int]) -> list[int]:
    return [i for b in bodies for i in range(model.body_dofadr[b], model.body_dofadr[b] + model.body_dofnum[b])]


def _parent_with_joints(model: mujoco.MjModel, b: int) -> int:
    """The nearest body above that has a joint; 0 for none."""
    b = int(model.body_parentid[b])
    while b and not model.body_jntnum[b]:
        b = int(model.body_parentid[b])
    return b


def _one_ball(model: mujoco.MjModel, data: mujoco.MjData, b: int, near: float) -> list[int]:
    """The body b and those above it that turn about the same point."""
    bodies, parent = [b], int(model.body_parentid[b])
    at = _anchors(model, data, b)
    while parent and model.body_jntnum[parent] and _only_child(model, bodies[-1]):
        if np.ptp(np.vstack([at, _anchors(model, data, parent)]), axis=0).max() >= near:
            break
        bodies.append(parent)
        parent = int(model.body_parentid[parent])
    return bodies


def _only_child(model: mujoco.MjModel, b: int) -> bool:
    return int(np.sum(model.body_parentid[1:] == model.body_parentid[b])) == 1


def _anchors(model: mujoco.MjModel, data: mujoco.MjData, b: int) -> Array:
    return np.asarray(data.xanchor[model.body_jntadr[b] : model.body_jntadr[b] + model.body_jntnum[b]])


def _held(model: mujoco.MjModel) -> set[int]:
    """Degrees of freedom with an actuator or a spring."""
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    driven = {int(j) for t, j in zip(model.actuator_trntype, model.actuator_trnid[:, 0], strict=True) if int(t) in kinds}
    springs = {j for j in range(model.njnt) if model.jnt_stiffness[j] > 0}
    return {i for i in range(model.nv) if int(model.dof_jntid[i]) in driven | springs}
