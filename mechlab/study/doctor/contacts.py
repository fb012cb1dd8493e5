"""Shapes that touch in the reference pose: they push the mechanism apart, or hold it still."""

from __future__ import annotations

import copy
from collections.abc import Iterator

import mujoco
import numpy as np

from mechlab.mechanism.geometry import Array
from mechlab.simulate.control import engine
from mechlab.study.doctor.masses import _body
from mechlab.study.doctor.result import Symptom
from mechlab.study.doctor.softness import active, listed

PASTE = '<default><geom contype="0" conaffinity="0"/></default>'
DEEP = 1e-3
"""Overlap, over the size of the model, that is more than standing on a floor."""


def contacts(model: mujoco.MjModel, qpos: Array) -> Iterator[Symptom]:
    """Finding "contacts": an error where two moving parts overlap, a warning for other contacts of the start."""
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
        said = [f"{_body(model, a)} and {_body(model, b)} by {-x:.3g} m" for (a, b), x in parts.items()]
        loop = any(p in joined for p in parts)
        text = (
            f"in the reference pose the shapes of {listed(said)} overlap: contact pushes them apart"
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
