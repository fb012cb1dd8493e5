"""A floating base that nothing carries: it falls for ever, and has no rest to swing about."""

from __future__ import annotations

import numpy as np

from mechlab.errors import NoSolution
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body
from mechlab.studies.modes.eigen import Dynamics

SHIFTS = (-0.1, -10.0)
"""Falls, in sizes of the mechanism, after which the force must be the same as at the start."""


def refuse_falling(dynamics: Dynamics, q: Array) -> None:
    """Raise NoSolution, with the base and how to hold it, when a part that slides along gravity is driven by a constant force.

    The force along the fall is compared at q (nq,) and after two falls: springs, servos and loops would change it.
    """
    m, x = dynamics.mechanism, dynamics.pose(q)
    to_engine = dynamics.rates(np.eye(m.nv)).T
    rows = dynamics.rows(x)
    for body, fall in _falls(m, q):
        along = to_engine @ fall
        if len(rows) and np.max(np.abs(rows @ along)) > 1e-9:
            continue
        poses = [x, *(dynamics.moved(x, s * (m.size or 1.0) * along) for s in SHIFTS)]
        forces = [float(dynamics.force(p) @ along) for p in poses]
        weight = m.total_mass * float(np.linalg.norm(m.gravity))
        if abs(forces[0]) > 1e-9 * weight and np.allclose(forces, forces[0], rtol=1e-9):
            raise NoSolution(_sentence(m, body, abs(forces[0])))


def _falls(m: Mechanism, q: Array) -> list[tuple[Body, Array]]:
    """Bodies whose own and carrying prismatic joints move them along gravity, each with these rates (nv,) for 1 m/s upwards."""
    g = np.array(m.gravity)
    if not np.any(g):
        return []
    sliding = np.concatenate([np.full(j.nv, j.kind == "prismatic") for j in m.joints] or [np.zeros(0, dtype=bool)])
    tree, out = TreeKinematics(m, q), []
    for body in m.bodies:
        if not any(j.kind == "prismatic" for j in body.joints):
            continue
        columns = tree.jacobian(body.name, tree.pose(body.name)[1])[:3] * sliding
        up = -g / np.linalg.norm(g)
        rates = np.linalg.lstsq(columns, up, rcond=1e-9)[0]
        if np.max(np.abs(columns @ rates - up)) < 1e-9:
            out.append((body, rates))
    return out


def _sentence(m: Mechanism, body: Body, force: float) -> str:
    path, name = [], body.name
    while name != GROUND:
        path.append(m.body(name))
        name = path[-1].parent
    held = [b for b in reversed(path) if b.joints]
    joints = ", ".join(j.name for b in held for j in b.joints)
    welds = " ".join(f"b.change_body({b.name!r}, joints=());" for b in held)
    return (
        f"{m.name}: nothing carries {body.name} and what hangs on it ({force:.4g} N): it floats on {joints} and falls, so there is no "
        "rest to swing about (contacts, such as feet on a floor, are not modelled here). Hold it, here by a weld to the ground: "
        f"b = ml.edit(ml.load(FILE)); {welds} ml.modes(b.assemble())."
    )
