"""Findings on the parts of a compiled MuJoCo model: tendons, dry friction; masses and sizes that suggest wrong units;
shapes that overlap in the reference pose."""

from __future__ import annotations

import copy
from collections.abc import Iterator

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.rows import active, joint_of_dof, name_of, tendon_moments, tied_bodies
from mechlab.engines.mujoco.model_file.start import start_data, start_pose
from mechlab.engines.mujoco.model_file.trace import integrator_name
from mechlab.experiment.recording import Symptom
from mechlab.mechanism.geometry import Array
from mechlab.tables import listed

IMPLICIT = ("implicitfast", "implicit")


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


HARD_FRICTION = 4.0
"""Time constant of dry friction, in timesteps, up to which it is hard."""


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


LARGE, SMALL_G = 50.0, 100.0
"""A model larger than LARGE [m] is probably in millimetres; gravity above SMALL_G [m/s^2] is probably in mm/s^2."""
FAR = 20.0
"""Radius of gyration of a body, relative to the size of the model, above which its inertia must be in other units."""


def masses(model: mujoco.MjModel) -> Iterator[Symptom]:
    """Findings "millimetres", "gravity_unit", "inertia_unit"."""
    size, gravity = float(model.stat.extent), float(np.linalg.norm(model.opt.gravity))
    span = np.ptp(np.vstack([model.body_pos, model.body_ipos]), axis=0).max(initial=0.0)
    moving = [b for b in range(1, model.nbody) if model.body_weldid[b] and model.body_mass[b] > 0]
    if span > LARGE and 1.0 < gravity < SMALL_G:
        text = f"bodies lie {span:.4g} m apart, under a gravity of {gravity:.4g} m/s^2: lengths are probably in millimetres."
        yield Symptom("millimetres", "error", text)
    if gravity > SMALL_G:
        text = f"gravity is {gravity:.4g} m/s^2: in millimetres? MuJoCo has no units; lengths, masses and forces must then fit."
        yield Symptom("gravity_unit", "warning", text)
    far = []
    for b in moving:
        radius = float(np.sqrt(np.max(model.body_inertia[b]) / model.body_mass[b]))
        if radius > FAR * max(size, float(span), 1e-9):
            far.append(f"{name_of(model, 'BODY', b)} ({radius:.3g} m)")
    if far:
        text = f"the radius of gyration of {listed(far)} is far beyond the size of the model, {max(size, span):.3g} m:"
        yield Symptom("inertia_unit", "error", f"{text} inertias in kg mm^2, or masses in tonnes.")


DEEP = 1e-3
"""Overlap of two shapes, relative to the size of the model, that is deeper than a resting contact."""


def contacts(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    """Finding "contacts": moving parts that overlap in the pose qpos (nq,); the number is the contact force over the weight. An
    error where contact works against a loop, else a warning: few models are meant to start at qpos0. A note for other contacts."""
    between = _touching(model, qpos)
    parts = {p: x for p, x in between.items() if _deep(model, p, x[0])}
    if parts:
        overlaps = [f"{name_of(model, 'BODY', a)} and {name_of(model, 'BODY', b)} by {-x[0]:.3g} m" for (a, b), x in parts.items()]
        joined = _joined(model)
        loop = any(p in joined for p in parts)
        weight = float(model.body_mass.sum() * (np.linalg.norm(model.opt.gravity) or 9.81))
        heavy = max(f for _, f in parts.values()) / max(weight, 1e-300)
        text = (
            f"at the start the shapes of {listed(overlaps)} overlap: contact pushes them apart"
            f"{', against the loop that joins them' if loop else ''}, with {heavy:.2g} times the weight of the model."
        )
        yield Symptom("contacts", "error" if loop else "warning", text, exclude(model, list(parts)), heavy)
    elif active(model) and between:
        text = f"{len(between)} pairs of shapes touch at the start; contacts are soft, like everything in MuJoCo but more so."
        yield Symptom("contacts", "note", text, number=len(between))


def _deep(model: mujoco.MjModel, pair: tuple[int, int], distance: float) -> bool:
    return bool(distance < -DEEP * model.stat.extent) and all(model.body_weldid[b] for b in pair)


def overlapping(model: mujoco.MjModel) -> list[tuple[str, str]]:
    """Names of the pairs of moving bodies that overlap at the start; those without a name are left out."""
    qpos = start_pose(model)
    pairs = [p for p, x in _touching(model, qpos).items() if _deep(model, p, x[0])]
    return _named(model, pairs)


def _named(model: mujoco.MjModel, pairs: list[tuple[int, int]]) -> list[tuple[str, str]]:
    names = [[mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, b) for b in p] for p in pairs]
    return [(str(a), str(b)) for a, b in names if a and b]


def _touching(model: mujoco.MjModel, qpos: Array) -> dict[tuple[int, int], tuple[float, float]]:
    """Pairs of bodies in contact -> (largest depth as a negative distance [m], sum of the normal forces [N])."""
    data = start_data(model, qpos)
    with engine():
        mujoco.mj_forward(model, data)
    force = np.zeros(6)
    between: dict[tuple[int, int], tuple[float, float]] = {}
    for k in range(data.ncon):
        pair = sorted(int(model.geom_bodyid[g]) for g in data.contact[k].geom if g >= 0)
        if len(pair) == 2:
            mujoco.mj_contactForce(model, data, k, force)
            depth, total = between.get((pair[0], pair[1]), (0.0, 0.0))
            between[pair[0], pair[1]] = min(depth, float(data.contact[k].dist)), total + abs(float(force[0]))
    return between


def exclude(model: mujoco.MjModel, pairs: list[tuple[int, int]]) -> str:
    """The element that switches off contact between pairs of bodies; those without a name cannot be written."""
    lines = [f'  <exclude body1="{a}" body2="{b}"/>' for a, b in _named(model, pairs)]
    return "\n".join(["<contact>", *lines, "</contact>"]) if lines else ""


def _joined(model: mujoco.MjModel) -> set[tuple[int, int]]:
    """Pairs of bodies that a connect or weld joins."""
    pairs = (sorted(tied_bodies(model, k)) for k in active(model))
    return {(pair[0], pair[1]) for pair in pairs if len(pair) == 2}
