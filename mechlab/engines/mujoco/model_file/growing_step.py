"""Springs, dampers and servos that the integrator of the file cannot follow at its timestep.

Linearised at rest on the motions z that the equality rows allow, M z'' + D z' + K z = 0 (springs, tendons, position and
velocity servos; no weight). A step of the integrator is a matrix; by it no motion may grow that the equations damp.
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.rows import EqualityRows
from mechlab.engines.mujoco.model_file.trace import INTEGRATORS
from mechlab.experiment.recording import Symptom
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space

GROWTH = 1.0 + 1e-4
"""Growth factor of one step that is more than rounding."""


MOST_COORDINATES = 200
"""Coordinates above which the stability of a step is not examined: it takes the eigenvalues of many matrices of twice that size."""


def too_large(model: mujoco.MjModel) -> bool:
    """Whether the model has too many coordinates to be examined here."""
    return bool(model.nv > MOST_COORDINATES)


def growing_step(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    """Finding "unstable_step": names the joint that moves most in the growing motion, and a timestep without growth."""
    if not model.nv or too_large(model):
        return
    m, k, d, d_explicit, basis = _linear(model, qpos)
    if not basis.shape[1] or not (np.any(k) or np.any(d)):
        return
    name, h = integrator_name(model), float(model.opt.timestep)
    own = np.linalg.eigvals(_rates(m, k, d))
    if np.max(own.real, initial=0.0) > 1e-6 * float(np.max(np.abs(own), initial=1.0)):
        return  # the equations themselves grow: a negative stiffness
    growth, vector = _worst(name, h, m, k, d, d_explicit)
    if growth <= GROWTH:
        return
    fits = h
    while fits > 1e-9 * h and _worst(name, fits, m, k, d, d_explicit)[0] > GROWTH:
        fits *= 0.5
    culprit = joint_of_dof(model, int(np.argmax(np.abs(basis @ vector))))
    text = (
        f"a spring, damper or servo at {culprit} is too stiff for {name} at {h:g} s: each step makes its motion {growth:.3g} "
        f"times as large. {name} needs {fits:.2g} s; 'discrete' takes stiff springs and dampers at any step, in first order."
    )
    cure = f'<option integrator="discrete"/>   or   <option timestep="{fits:.2g}"/>'
    yield Symptom("unstable_step", "error", text, cure, growth)


def _linear(model: mujoco.MjModel, qpos: Array) -> tuple[Array, Array, Array, Array, Array]:
    """M, K, D and the part of D that Euler takes explicitly, on the basis (nv, n) of the free motions."""
    with engine():
        rows = EqualityRows(model, qpos)
        _, jacobian = rows.at(qpos)
        data, nv = rows.data, model.nv
        mass = np.zeros((nv, nv))
        mujoco.mj_fullM(rows.model, data, mass)
        tendon = tendon_moments(rows.model, data)
        count = len(model.actuator_dyntype)  # not nu: an actuator may have several controls
        actuator = np.zeros((count, nv))
        if count:
            mujoco.mju_sparse2dense(
                actuator, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
            )
    springs = np.zeros((nv, nv))
    for j in range(model.njnt):
        i, kind = int(model.jnt_dofadr[j]), mujoco.mjtJoint(model.jnt_type[j])
        n = {mujoco.mjtJoint.mjJNT_FREE: 6, mujoco.mjtJoint.mjJNT_BALL: 3}.get(kind, 1)
        springs[range(i, i + n), range(i, i + n)] = model.jnt_stiffness[j]
    springs += tendon.T @ np.diag(model.tendon_stiffness) @ tendon
    servo = np.where(model.actuator_dyntype == mujoco.mjtDyn.mjDYN_NONE, 1.0, 0.0)
    springs -= actuator.T @ np.diag(servo * model.actuator_biasprm[:, 1]) @ actuator
    explicit = tendon.T @ np.diag(model.tendon_damping) @ tendon
    explicit -= actuator.T @ np.diag(servo * model.actuator_biasprm[:, 2]) @ actuator
    joints = np.diag(model.dof_damping)
    basis = null_space(jacobian)
    m, k, own, other = (basis.T @ x @ basis for x in (mass, springs, joints, explicit))
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP:
        other, own = other + own, np.zeros_like(own)
    return m, k, own + other, other, basis


def _rates(m: Array, k: Array, d: Array) -> Array:
    n, inverse = len(m), np.linalg.inv(m)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ k, -inverse @ d]])


def _worst(name: str, h: float, m: Array, k: Array, d: Array, explicit: Array) -> tuple[float, Array]:
    """The largest growth of a step, and the motion (n,) that grows."""
    n = len(m)
    if name == "RK4":
        values, vectors = np.linalg.eig(_rates(m, k, d))
        z = values * h
        growth = np.abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24)
    else:
        later = k if name == "discrete" else np.zeros_like(k)
        held = explicit if name == "Euler" else np.zeros_like(explicit)
        inverse = np.linalg.inv(m + h * (d - held) + h * h * later)
        rate = np.block([-h * inverse @ k, inverse @ (m - h * held)])
        values, vectors = np.linalg.eig(np.vstack([np.hstack([np.eye(n), np.zeros((n, n))]) + h * rate, rate]))
        growth = np.abs(values)
    worst = int(np.argmax(growth))
    return float(growth[worst]), np.asarray(np.abs(vectors[:n, worst]))


def integrator_name(model: mujoco.MjModel) -> str:
    """The integrator's name."""
    return next(n for n, k in INTEGRATORS.items() if k == model.opt.integrator)


def tendon_moments(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """(ntendon, nv) dense Jacobian of the tendon lengths."""
    out = np.zeros((model.ntendon, model.nv))
    for k in range(model.ntendon):
        start, count = int(model.ten_J_rowadr[k]), int(model.ten_J_rownnz[k])
        flat = np.asarray(data.ten_J).ravel()
        out[k, model.ten_J_colind[start : start + count]] = flat[start : start + count]
    return out


def name_of(model: mujoco.MjModel, kind: str, k: int) -> str:
    """The name of element k of a kind ("JOINT", "TENDON"), or its number where it has none."""
    return mujoco.mj_id2name(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), k) or f"{kind.lower()} number {k}"


def joint_of_dof(model: mujoco.MjModel, i: int) -> str:
    """The name of the joint to which degree of freedom i belongs."""
    return name_of(model, "JOINT", int(model.dof_jntid[i]))
