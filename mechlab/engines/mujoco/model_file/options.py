"""Findings on the options of a MuJoCo model: Jacobian, autoreset, activations, and whether the integrator can follow the model at
its timestep. `settings_to_paste` makes the recommended `<option>` and default class of equalities from what was found.

`growing_step`: linearized at rest on the motions z that the equality rows allow, M z'' + D z' + K z = 0 (springs, tendons,
position and velocity servos; no weight), a step of the integrator is a matrix; by it no motion may grow that the equations damp.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.rows import EqualityRows, joint_of_dof, loops, name_of, tendon_moments
from mechlab.engines.mujoco.model_file.softness import equality_default
from mechlab.engines.mujoco.model_file.trace import integrator_name
from mechlab.engines.mujoco.model_file.trial import TrialRun
from mechlab.experiment.recording import Symptom
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space
from mechlab.tables import listed

IN_URDF = (
    '<mujoco><compiler discardvisual="false"/><option integrator="RK4" timestep="0.001" jacobian="dense"/></mujoco>'
)
"""For a URDF that is to be opened in MuJoCo: a child of <robot>."""


def settings_to_paste(model: mujoco.MjModel, trial: TrialRun | None, findings: Iterable[Symptom]) -> str:
    """The text; an XML comment says which attributes to delete; "" for a model in which nothing needs to change.

    The integrator is the one that completed the trial. A model without loops that lives by contacts keeps the integrator of its
    file: RK4 gains nothing there.
    """
    h, kept = float(model.opt.timestep), integrator_name(model)
    found = list(findings)
    unstable = any(f.name == "unstable_step" for f in found)
    if not loops(model):
        if unstable:
            return f'<option timestep="{h:g}" integrator="discrete"/>'
        coarse = trial is not None and not trial.touched and any(f.name == "trial" and f.severity != "note" for f in found)
        return f'<option timestep="{h:g}" integrator="RK4"/>' if coarse and kept != "RK4" else ""
    better = trial.shown.better if trial is not None and trial.shown.better else "discrete"
    if trial is not None and "contacts" in trial.touched and not trial.reason:
        better = kept
    lines = [
        f'<option timestep="{h:g}" integrator="{"discrete" if unstable else better}" jacobian="dense">',
        '  <flag autoreset="disable"/>',
        "</option>",
        equality_default(h),
        "<!-- an equality with a solref or solimp of its own keeps it: delete those attributes -->",
    ]
    return "\n".join(lines)


WRONG = 1e-6
"""Relative difference of accelerations by sparse and dense Jacobian beyond rounding (1e-12 was measured)."""


def options(model: mujoco.MjModel, qpos: Array, trial: TrialRun | None = None) -> Iterator[Symptom]:
    """Findings on options: "sparse_jacobian", "autoreset", "first_order", "first_order_activation"."""
    yield from _sparse(model, qpos)
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET:
        text = (
            "autoreset is on, MuJoCo's default: a run that blows up starts again from the reference pose and goes on; nothing but a "
            "counter (mjData.warning) tells."
        )
        yield Symptom("autoreset", "note", text, '<option><flag autoreset="disable"/></option>')
    name = integrator_name(model)
    if name != "RK4" and loops(model):
        shown = None if trial is None else trial.shown
        step = None if shown is None or not np.isfinite(shown.step) else shown.step
        text = f"{name} closes the loops but is of first order: a small gap does not mean a right motion"
        if step is None or shown is None:
            yield Symptom("first_order", "warning", f"{text}.", '<option integrator="RK4"/>')
        else:
            share = step / max(shown.moved, 1e-2 * shown.size)
            text += f". With half its timestep a run of this file changes by {step:.2g} m ({100 * share:.2g} % of its motion)."
            severe = share > STEP_MATTERS and not shown.touched
            cure = "" if shown.touched else '<option integrator="RK4"/>'
            yield Symptom("first_order", "warning" if severe else "note", text, cure, step)
    if name == "RK4" and model.na:
        names = [name_of(model, "ACTUATOR", k) for k in range(len(model.actuator_dyntype)) if model.actuator_dyntype[k]]
        text = f"{listed(names)} has a state (activation), which MuJoCo integrates in first order beside RK4."
        yield Symptom("first_order_activation", "warning", text)


STEP_MATTERS = 1e-3
"""Change of a run with half its timestep, over its motion, from which on the order of the integrator matters."""


def _sparse(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    if not mujoco.mj_isSparse(model) or not loops(model):
        return
    paste = '<option jacobian="dense"/>'
    worst = _sparse_error(model, qpos)
    if worst > WRONG:
        text = f"with the sparse Jacobian the accelerations are wrong by {worst:.2g} of their size, against a dense one"
        yield Symptom("sparse_jacobian", "error", f"{text} (MuJoCo issue 3767, version 4.0.0).", paste)
    elif mujoco.mj_versionString() == "4.0.0":
        text = (
            "the Jacobian is sparse, whose factorization gives wrong accelerations on some models in MuJoCo 4.0.0 (issue 3767: "
            f"17 of 300 measured); at three poses of this one it is right to {worst:.1g}."
        )
        yield Symptom("sparse_jacobian", "warning", text, paste)


def _sparse_error(model: mujoco.MjModel, qpos: Array) -> float:
    """Largest relative difference of accelerations between the two Jacobians, at random states near qpos."""
    rng, worst = np.random.default_rng(5), 0.0
    found: list[list[Array]] = []
    moves = [0.05 * rng.standard_normal(model.nv) for _ in range(3)]
    for kind in (mujoco.mjtJacobian.mjJAC_SPARSE, mujoco.mjtJacobian.mjJAC_DENSE):
        other = copy.copy(model)
        other.opt.jacobian = kind
        other.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        data, out = mujoco.MjData(other), []
        with engine():
            for move in moves:
                mujoco.mj_resetData(other, data)
                data.qpos[:] = qpos
                mujoco.mj_integratePos(other, data.qpos, move, 1.0)
                data.qvel[:] = move
                mujoco.mj_forward(other, data)
                out.append(np.array(data.qacc))
        found.append(out)
    for a, b in zip(*found, strict=True):
        worst = max(worst, float(np.max(np.abs(a - b), initial=0.0) / max(1.0, float(np.max(np.abs(b), initial=0.0)))))
    return worst


GROWTH = 1.0 + 1e-4
"""Growth factor of one step that is more than rounding."""


MOST_COORDINATES = 200
"""Coordinates above which the stability of a step is not examined: it takes the eigenvalues of many matrices of twice that size."""


def too_large(model: mujoco.MjModel) -> bool:
    """Whether the model has too many coordinates for `growing_step`."""
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
