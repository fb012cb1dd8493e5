"""Findings on options and parts of a MuJoCo model: integrator, Jacobian, autoreset, activations, tendons, friction, limits.

`settings_to_paste` makes the recommended `<option>` and default class of equalities from what was found.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.growing_step import integrator_name, joint_of_dof, name_of, tendon_moments
from mechlab.experiment.recording import Symptom
from mechlab.mechanism.geometry import Array
from mechlab.studies.doctor.softness import active, equality_default, listed
from mechlab.studies.doctor.trial import TrialRun

IN_URDF = (
    '<mujoco><compiler discardvisual="false"/><option integrator="RK4" timestep="0.001" jacobian="dense"/></mujoco>'
)
"""For a URDF that is to be opened in MuJoCo: a child of <robot>."""


def settings_to_paste(model: mujoco.MjModel, trial: TrialRun | None, findings: Iterable[Symptom]) -> str:
    """MJCF settings: an <option> and, with equalities, their default class. The integrator is the one that passed the
    trial."""
    h = float(model.opt.timestep)
    better = trial.better if trial is not None and trial.better else "discrete"
    if any(f.name == "unstable_step" for f in findings):
        better = "discrete"
    lines = [
        f'<option timestep="{h:g}" integrator="{better}" jacobian="dense">',
        '  <flag autoreset="disable"/>',
        "</option>",
    ]
    if active(model):
        lines.append(equality_default(h))
        lines.append("<!-- an equality with a solref or solimp of its own keeps it: delete those attributes -->")
    return "\n".join(lines)


WRONG = 1e-6
"""Relative difference of accelerations between sparse and dense Jacobian above which it is not rounding
(measured: 1e-12)."""
IMPLICIT = ("implicitfast", "implicit")


def options(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    """Findings on options: "sparse_jacobian", "autoreset", "first_order", "first_order_activation", "fast_activation"."""
    yield from _sparse(model, qpos)
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET:
        text = (
            "autoreset is on: a run that blows up starts again from the reference pose and goes on; nothing but a counter "
            "(mjData.warning) tells."
        )
        yield Symptom("autoreset", "warning", text, '<option><flag autoreset="disable"/></option>')
    name = integrator_name(model)
    if name != "RK4" and active(model):
        text = (
            f"{name} closes the loops but is of first order: phase and energy drift (a four-bar was 0.26 rad wrong after 1 s at "
            "1 ms where RK4 was 9e-5). A small gap does not mean a right motion."
        )
        yield Symptom("first_order", "warning", text, '<option integrator="RK4"/>')
    if name == "RK4" and model.na:
        names = [name_of(model, "ACTUATOR", k) for k in range(model.nu) if model.actuator_dyntype[k]]
        text = f"{listed(names)} has a state (activation), which MuJoCo integrates in first order beside RK4."
        yield Symptom("first_order_activation", "warning", text)
    yield from _fast_activation(model)


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


def _fast_activation(model: mujoco.MjModel) -> Iterator[Symptom]:
    h, kind = float(model.opt.timestep), mujoco.mjtDyn.mjDYN_FILTER
    quick = [k for k in range(model.nu) if model.actuator_dyntype[k] == kind and model.actuator_dynprm[k, 0] < h]
    if quick:
        names = [name_of(model, "ACTUATOR", k) for k in quick]
        text = f"the time constant of {listed(names)} is below the timestep {h:g} s: the filter is unstable or does nothing."
        yield Symptom("fast_activation", "error", text, 'dyntype="filterexact"')


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
    """Findings "curved_equality" (MuJoCo omits dJ/dt v) and "held_friction" (friction of a tendon that an equality
    holds)."""
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
    """Two degrees of freedom with nonzero moment of which neither is an ancestor of the other; None without such a
    pair."""
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
    """Finding "soft_friction": dry friction whose solref or solimp is as soft as the default."""
    dofs = [i for i in range(model.nv) if model.dof_frictionloss[i] > 0]
    soft = [
        i for i in dofs if model.dof_solref[i, 0] > HARD_FRICTION * model.opt.timestep or model.dof_solimp[i, 1] < 0.99
    ]
    names = list(dict.fromkeys(joint_of_dof(model, i) for i in soft))
    ropes = [k for k in range(model.ntendon) if model.tendon_frictionloss[k] > 0]
    names += [name_of(model, "TENDON", k) for k in ropes if model.tendon_solimp_fri[k, 1] < 0.99]
    if names:
        text = (
            f"the dry friction of {listed(names)} is as soft as MuJoCo's default: what should stick creeps, what should stop "
            "stops late, and the order of RK4 is lost. It has a solref of its own."
        )
        h = float(model.opt.timestep)
        paste = f'<default><joint solreffriction="{2 * h:g} 1" solimpfriction=".9999 .9999 .001 .5 2"/></default>'
        yield Symptom("soft_friction", "warning", text, paste)


# time constant of the friction row, in timesteps, up to which it counts as hard
HARD_FRICTION = 4.0


def limits(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    """Finding "beyond_range": a joint that starts outside its range is pushed by its stop."""
    out = []
    for j in range(model.njnt):
        single = int(model.jnt_type[j]) in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
        if model.jnt_limited[j] and single:
            value, (low, high) = float(qpos[model.jnt_qposadr[j]]), model.jnt_range[j]
            if not low - 1e-9 <= value <= high + 1e-9:
                out.append(f"{name_of(model, 'JOINT', j)} ({value:.4g}, range {low:.4g} to {high:.4g})")
    if out:
        text = f"the reference pose is outside the range of {listed(out)}: the stop pushes from the first step on"
        yield Symptom("beyond_range", "error", f"{text}; degrees written as radians look like this, too.")
