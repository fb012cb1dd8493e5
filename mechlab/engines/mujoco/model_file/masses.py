"""Findings on the compiled model: masses and sizes that suggest wrong units, shapes that overlap in the reference pose."""

from __future__ import annotations

import copy
from collections.abc import Iterator

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.softness import active, listed
from mechlab.experiment.recording import Symptom
from mechlab.mechanism.geometry import Array

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
            far.append(f"{_body(model, b)} ({radius:.3g} m)")
    if far:
        text = f"the radius of gyration of {listed(far)} is far beyond the size of the model, {max(size, span):.3g} m:"
        yield Symptom("inertia_unit", "error", f"{text} inertias in kg mm^2, or masses in tonnes.")


def _body(model: mujoco.MjModel, b: int) -> str:
    return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, b) or f"body number {b}"


DEEP = 1e-3
"""Overlap of two shapes, relative to the size of the model, that is deeper than a resting contact."""
HEAVY = 10.0
"""A contact force at the start above this many times the weight of the model is an error of the file."""


def contacts(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    """Finding "contacts": moving parts that overlap in the pose qpos (nq,); the number is the contact force over the weight. An
    error where contact works against a loop, or with more than HEAVY times the weight; a note for other contacts of loops."""
    probe = copy.copy(model)
    data = mujoco.MjData(probe)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(probe, data, 0)
    data.qpos[:] = qpos
    with engine():
        mujoco.mj_forward(probe, data)
    joined, force = _joined(model), np.zeros(6)
    between: dict[tuple[int, int], tuple[float, float]] = {}
    for k in range(data.ncon):
        pair = sorted(int(model.geom_bodyid[g]) for g in data.contact[k].geom if g >= 0)
        if len(pair) == 2:
            mujoco.mj_contactForce(probe, data, k, force)
            depth, total = between.get((pair[0], pair[1]), (0.0, 0.0))
            between[pair[0], pair[1]] = min(depth, float(data.contact[k].dist)), total + abs(float(force[0]))
    deep = -DEEP * model.stat.extent
    parts = {p: x for p, x in between.items() if x[0] < deep and all(model.body_weldid[b] for b in p)}
    if parts:
        overlaps = [f"{_body(model, a)} and {_body(model, b)} by {-x[0]:.3g} m" for (a, b), x in parts.items()]
        loop = any(p in joined for p in parts)
        weight = float(model.body_mass.sum() * (np.linalg.norm(model.opt.gravity) or 9.81))
        heavy = max(f for _, f in parts.values()) / max(weight, 1e-300)
        text = (
            f"at the start the shapes of {listed(overlaps)} overlap: contact pushes them apart"
            f"{', against the loop that joins them' if loop else ''}, with {heavy:.2g} times the weight of the model."
        )
        yield Symptom("contacts", "error" if loop or heavy > HEAVY else "warning", text, exclude(model, list(parts)), heavy)
    elif active(model) and between:
        text = f"{len(between)} pairs of shapes touch at the start; contacts are soft, like everything in MuJoCo but more so."
        yield Symptom("contacts", "note", text, number=len(between))


def exclude(model: mujoco.MjModel, pairs: list[tuple[int, int]]) -> str:
    """The element that switches off contact between pairs of bodies; those without a name cannot be written."""
    names = [tuple(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, b) for b in p) for p in pairs]
    lines = [f'  <exclude body1="{a}" body2="{b}"/>' for a, b in names if a and b]
    return "\n".join(["<contact>", *lines, "</contact>"]) if lines else ""


def _joined(model: mujoco.MjModel) -> set[tuple[int, int]]:
    """Pairs of bodies that a connect or weld joins."""
    out = set()
    for k in active(model):
        if int(model.eq_type[k]) in (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)):
            ends = [int(model.eq_obj1id[k]), int(model.eq_obj2id[k])]
            if model.eq_objtype[k] == mujoco.mjtObj.mjOBJ_SITE:
                ends = [int(model.site_bodyid[e]) for e in ends]
            a, b = np.sort(ends)
            out.add((int(a), int(b)))
    return out
