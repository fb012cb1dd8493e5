"""Findings on options and parts of a MuJoCo model: integrator, Jacobian, autoreset, activations, tendons, friction, limits.

`settings_to_paste` makes the recommended `<option>` and default class of equalities from what was found.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.growing_step import integrator_name, joint_of_dof, name_of, tendon_moments
from mechlab.engines.mujoco.model_file.softness import active, equality_default, listed, loops
from mechlab.engines.mujoco.model_file.trial import TrialRun
from mechlab.experiment.recording import Symptom
from mechlab.mechanism.geometry import Array

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
    if not loops(model) and trial is not None and (trial.touched or not any(f.severity == "error" for f in found)):
        if not unstable:
            return "" if trial.touched or kept == "RK4" else f'<option timestep="{h:g}" integrator="RK4"/>'
        return f'<option timestep="{h:g}" integrator="discrete"/>'
    better = trial.shown.better if trial is not None and trial.shown.better else "discrete"
    lines = [
        f'<option timestep="{h:g}" integrator="{"discrete" if unstable else better}" jacobian="dense">',
        '  <flag autoreset="disable"/>',
        "</option>",
    ]
    if loops(model):
        lines.append(equality_default(h))
        lines.append("<!-- an equality with a solref or solimp of its own keeps it: delete those attributes -->")
    return "\n".join(lines)


WRONG = 1e-6
"""Relative difference of accelerations by sparse and dense Jacobian beyond rounding (1e-12 was measured)."""
IMPLICIT = ("implicitfast", "implicit")


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
            yield Symptom("first_order", "warning" if severe else "note", text, '<option integrator="RK4"/>', step)
    if name == "RK4" and model.na:
        names = [name_of(model, "ACTUATOR", k) for k in range(len(model.actuator_dyntype)) if model.actuator_dyntype[k]]
        text = f"{listed(names)} has a state (activation), which MuJoCo integrates in first order beside RK4."
        yield Symptom("first_order_activation", "warning", text)


STEP_MATTERS = 1e-3
"""Change of a run with half its timestep, over its motion, from which on the order of the integrator matters."""


def _sparse(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    if not mujoco.mj_isSparse(model) or not active(model):
        return
    paste = '<option jacobian="dense"/>'
    worst = _sparse_error(model, qpos)
    if worst > WRONG:
        text = f"with the sparse Jacobian the accelerations are wrong by {worst:.2g} of their size, against a dense one"
        yield Symptom("sparse_jacobian", "error", f"{text} (MuJoCo issue 3767, version 4.0.0).", paste)
    elif mujoco.mj_versionString() == "4.0.0":
        text = (
            "the Jacobian is sparse, whose factorisation gives wrong accelerations on some models in MuJoCo 4.0.0 (issue 3767: "
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


def tendons(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    """Findings on tendons: "armature_across_branches", "damping_across_branches", "tendon_equality_lag", "held_friction"."""
    with engine():
        probe = copy.copy(model)
        probe.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        data = mujoco.MjData(probe)
        data.qpos[:] = qpos
        rng = np.random.default_rng(2)
        mujoco.mj_integratePos(probe, data.qpos, 0.01 * rng.standard_normal(model.nv), 1.0)
        mujoco.mj_fwdPosition(probe, data)
        moments = tendon_moments(probe, data)
    across = {k: pair for k in range(model.ntendon) if (pair := _branches(model, moments[k])) is not None}
    for k, (a, b) in across.items():
        name, ends = (
            name_of(model, "TENDON", k),
            f"{joint_of_dof(model, a)} and {joint_of_dof(model, b)}, which lie on different branches",
        )
        if model.tendon_armature[k] > 0:
            text = f"the armature of {name} couples {ends}: MuJoCo drops that term of the mass matrix and says nothing."
            yield Symptom("armature_across_branches", "error", text)
        damped = model.tendon_damping[k] > 0 or np.any(model.tendon_dampingpoly[k])
        if damped and integrator_name(model) in IMPLICIT:
            text = f"the damping of {name} couples {ends}: {integrator_name(model)} drops that term, momentum is lost."
            yield Symptom("damping_across_branches", "error", text, '<option integrator="RK4"/>')
        elif damped:
            text = (
                f"the damping of {name} couples {ends}: right with {integrator_name(model)}, wrong with implicitfast."
            )
            yield Symptom("damping_across_branches", "note", text)
    yield from _held(model)


def _held(model: mujoco.MjModel) -> Iterator[Symptom]:
    """Tendon equalities whose second derivative is not what it should be, and friction on tendons that stand still."""
    kind = mujoco.mjtEq
    curved, rubbing = [], []
    for k in active(model):
        if model.eq_type[k] == kind.mjEQ_TENDON:
            t = int(model.eq_obj1id[k])
            if model.wrap_type[model.tendon_adr[t]] != mujoco.mjtWrap.mjWRAP_JOINT:
                curved.append(name_of(model, "TENDON", t))
            if model.tendon_frictionloss[t] > 0 and model.eq_obj2id[k] < 0:
                rubbing.append(name_of(model, "TENDON", t))
        elif model.eq_type[k] == kind.mjEQ_JOINT and np.any(model.eq_data[k, 2:5]):
            curved.append(name_of(model, "JOINT", int(model.eq_obj1id[k])))
    if curved:
        text = (
            f"the equality of {listed(curved)} is not linear in the coordinates and MuJoCo leaves out its dJ/dt v: positions "
            "are right, accelerations and reactions are not."
        )
        yield Symptom("curved_equality", "warning", text)
    if rubbing:
        text = (
            f"frictionloss of {listed(rubbing)} does nothing: an equality holds the tendon still. Put it on the joints."
        )
        yield Symptom("held_friction", "warning", text)


def _branches(model: mujoco.MjModel, moment: Array) -> tuple[int, int] | None:
    """Two degrees of freedom with a moment of which neither is above the other in the tree."""
    dofs = [int(i) for i in np.flatnonzero(np.abs(moment) > 1e-12)]
    for n, b in enumerate(dofs):
        above, i = set(), b
        while i >= 0:
            above.add(i)
            i = int(model.dof_parentid[i])
        for a in dofs[:n]:
            if a not in above:
                return a, b
    return None


def friction(model: mujoco.MjModel) -> Iterator[Symptom]:
    """Finding "soft_friction": dry friction is a soft row, too."""
    dofs = [i for i in range(model.nv) if model.dof_frictionloss[i] > 0]
    soft = [
        i for i in dofs if model.dof_solref[i, 0] > HARD_FRICTION * model.opt.timestep or model.dof_solimp[i, 1] < 0.99
    ]
    names = list(dict.fromkeys(joint_of_dof(model, i) for i in soft))
    ropes = [k for k in range(model.ntendon) if model.tendon_frictionloss[k] > 0]
    names += [name_of(model, "TENDON", k) for k in ropes if model.tendon_solimp_fri[k, 1] < 0.99]
    if names:
        text = (
            f"the dry friction of {listed(names)} is as soft as MuJoCo makes it by default: what should stick creeps, what should stop "
            "stops late, and the order of RK4 is lost. It has a solref of its own."
        )
        h = float(model.opt.timestep)
        paste = f'<default><joint solreffriction="{2 * h:g} 1" solimpfriction=".9999 .9999 .001 .5 2"/></default>'
        yield Symptom("soft_friction", "note", text, paste)


HARD_FRICTION = 4.0
