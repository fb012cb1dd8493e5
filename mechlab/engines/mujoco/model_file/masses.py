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


PASTE = '<default><geom contype="0" conaffinity="0"/></default>'
DEEP = 1e-3
"""Overlap of two shapes, relative to the size of the model, that is deeper than a resting contact."""


def contacts(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    """Finding "contacts": an error where two moving parts overlap, a warning for other contacts in the pose qpos
    (nq,)."""
    probe = copy.copy(model)
    data = mujoco.MjData(probe)
    data.qpos[:] = qpos
    with engine():
        mujoco.mj_fwdPosition(probe, data)
    joined = _joined(model)
    between: dict[tuple[int, int], float] = {}
    for k in range(data.ncon):
        pair = sorted(int(model.geom_bodyid[g]) for g in data.contact[k].geom if g >= 0)
        if len(pair) == 2:
            a, b = pair
            between[a, b] = min(between.get((a, b), 0.0), float(data.contact[k].dist))
    parts = {p: x for p, x in between.items() if x < -DEEP * model.stat.extent and all(model.body_weldid[b] for b in p)}
    if parts:
        overlaps = [f"{_body(model, a)} and {_body(model, b)} by {-x:.3g} m" for (a, b), x in parts.items()]
        loop = any(p in joined for p in parts)
        text = (
            f"in the reference pose the shapes of {listed(overlaps)} overlap: contact pushes them apart"
            f"{', against the loop that joins them' if loop else ''}."
        )
        yield Symptom("contacts", "error", text, PASTE)
    elif active(model) and between:
        text = (
            f"{len(between)} pairs of shapes touch in the reference pose; contacts are soft and cost the order of RK4."
        )
        yield Symptom("contacts", "warning", text, PASTE)


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
