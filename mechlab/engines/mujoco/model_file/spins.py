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
    """(name of the body, number of its local freedoms); data: positions of any pose; jacobian (rows, nv): of a general one."""
    if not len(jacobian):
        return
    done: set[int] = set()
    held = _held(model)
    for b in range(model.nbody - 1, 0, -1):
        if b in done or not model.body_jntnum[b]:
            continue
        bodies = _one_ball(model, data, b, SAME * size)
        done |= set(bodies)
        dofs = [i for x in bodies for i in range(model.body_dofadr[x], model.body_dofadr[x] + model.body_dofnum[x])]
        if not _last(model, bodies) or held & set(dofs):
            continue
        columns = jacobian[:, dofs]
        values = np.linalg.svd(columns, compute_uv=False)
        if values[0] == 0.0:
            continue
        free = len(dofs) - int(np.sum(values > ZERO * values[0]))
        if free:
            yield mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, b) or f"body number {b}", free


def _one_ball(model: mujoco.MjModel, data: mujoco.MjData, b: int, near: float) -> list[int]:
    """The body b and those above it that turn about the same point."""
    bodies, parent = [b], int(model.body_parentid[b])
    at = _anchors(model, data, b)
    while parent and model.body_jntnum[parent] and np.ptp(np.vstack([at, _anchors(model, data, parent)]), axis=0).max() < near:
        bodies.append(parent)
        parent = int(model.body_parentid[parent])
    return bodies


def _anchors(model: mujoco.MjModel, data: mujoco.MjData, b: int) -> Array:
    return np.asarray(data.xanchor[model.body_jntadr[b] : model.body_jntadr[b] + model.body_jntnum[b]])


def _last(model: mujoco.MjModel, bodies: list[int]) -> bool:
    """Whether no joint hangs below these bodies."""
    below = set(bodies)
    for b in range(min(bodies) + 1, model.nbody):
        if int(model.body_parentid[b]) in below:
            if b not in below and model.body_jntnum[b]:
                return False
            below.add(b)
    return True


def _held(model: mujoco.MjModel) -> set[int]:
    """Degrees of freedom with an actuator or a spring."""
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    driven = {int(j) for t, j in zip(model.actuator_trntype, model.actuator_trnid[:, 0], strict=True) if int(t) in kinds}
    springs = {j for j in range(model.njnt) if model.jnt_stiffness[j] > 0}
    return {i for i in range(model.nv) if int(model.dof_jntid[i]) in driven | springs}
