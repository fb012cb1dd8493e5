"""Forces on the parts of a mechanism with one freedom while its drive turns steadily: the free-body diagrams of a cycle."""

from __future__ import annotations

import numpy as np

from mechlab.errors import EngineMissing
from mechlab.mechanism import Mechanism, TreeKinematics, structure
from mechlab.mechanism.geometry import Array
from mechlab.view.explore.sweep import Load, Sweep

FASTEST = 40.0
"""Rates of a joint per rate of the drive beyond which no forces are drawn: at a fold they have no bound."""
NOTHING = 1e-9
NEAREST = 0.01
"""Closeness to a singularity below which no forces are drawn."""


def cycle_loads(mechanism: Mechanism, sweep: Sweep, rate: float) -> tuple[Load, ...]:
    """Reactions of joints and loops, weights and the drive along a sweep at the constant `rate` [rad/s or m/s] of its
    drive, by Pinocchio; those that stay zero are left out. Empty where the mechanism has not one freedom, or Pinocchio is
    missing."""
    m = mechanism
    if structure(m).freedoms != 1 or m.total_mass <= 0.0:
        return ()
    from mechlab.study.cycle_forces import reactions

    fine = np.flatnonzero(
        np.all(np.isfinite(sweep.rates), axis=1)
        & (np.abs(sweep.rates).max(axis=1) < FASTEST)
        & (sweep.closeness > NEAREST)
    )
    if len(fine) < 2:
        return ()
    try:
        found = reactions(m, sweep.name, 0.0, sweep.q[fine], rate * sweep.rates[fine], np.zeros(m.nv))
    except EngineMissing:
        return ()
    tree = TreeKinematics(m)
    points = {name: np.full((len(sweep.q), 3), np.nan) for name in (*found.forces, *(b.name for b in m.bodies), "")}
    axes = np.full((len(sweep.q), 3), np.nan)
    joints = {j.name: (b, m.v_slice[j.name].start) for b in m.bodies for j in b.joints}
    for k in fine:
        tree.set(sweep.q[k])
        for body in m.bodies:
            points[body.name][k] = (tree.matrix(body.name) @ np.append(body.inertia.com, 1.0))[:3]
        for loop in m.loops:
            points[loop.name][k] = (tree.matrix(loop.body_b) @ np.append(loop.placement_b.translation, 1.0))[:3]
        for name, (_, column) in joints.items():
            points[name][k] = tree.anchors[column]
            if name == sweep.name:
                axes[k], points[""][k] = tree.axes[column], tree.anchors[column]

    def spread(values: Array) -> Array:
        out = np.full((len(sweep.q), 3), np.nan)
        out[fine] = values
        return out

    loads = [
        Load(x.name, "force", "N", x.body_b, x.body_a, points[x.name], spread(found.forces[x.name][:, :3]))
        for x in m.loops
    ]
    for name, (body, _) in joints.items():
        if name == body.joints[-1].name:
            force = spread(found.forces[name][:, :3])
            loads.append(Load(name, "force", "N", body.name, body.parent, points[name], force))
    gravity = np.array(m.gravity)
    for body in m.bodies:
        weight = np.tile(body.inertia.mass * gravity, (len(fine), 1))
        loads.append(Load(f"weight of {body.name}", "force", "N", body.name, "", points[body.name], spread(weight)))
    if sweep.name in joints:
        body = joints[sweep.name][0]
        kind, unit = ("force", "N") if sweep.unit == "m" else ("torque", "N m")
        driving = axes * spread(np.repeat(found.drive[:, None], 3, axis=1))
        loads.append(Load(f"{sweep.name} (drive)", kind, unit, body.name, body.parent, points[""], driving))
    return tuple(x for x in loads if float(np.nanmax(np.abs(x.vectors))) > NOTHING)
