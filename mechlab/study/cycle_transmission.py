"""Transmission along a cycle: the angle at which loops pass a load on, mechanical advantage, velocity ratio."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism import GROUND, Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.study.closed_path import PathPoint
from mechlab.study.witness import room

POINT_LOOPS = ("spherical", "revolute")


def outputs(m: Mechanism, drive: str, poses: Sequence[PathPoint], asked: str | None) -> str | None:
    """The joint whose load is looked at: the one asked for, else the last on the ground that moves and is not the
    drive, else None. Raises MechlabError for a name that does not exist or does not move."""
    moves = {n: any(abs(m.row(n) @ p.u) > 1e-9 for p in poses) for n in m.scalar_names}
    if asked is not None:
        m.row(asked)
        if not moves[asked] or asked == drive:
            raise MechlabError(
                f"{m.name}: output {asked!r} must be a joint that moves, other than the drive {drive!r}."
            )
        return asked
    grounded = [j.name for b in m.bodies if b.parent == GROUND for j in b.joints if j.nv == 1 and j.name != drive]
    found = [n for n in grounded if moves[n]]
    return found[-1] if found else None


def transmission(
    m: Mechanism, drive: str, output: str, poses: Sequence[PathPoint]
) -> tuple[dict[str, Array], dict[str, str]]:
    """velocity_ratio d(output)/d(drive), mechanical_advantage (load on the output per force of the drive, its inverse),
    and LOOP_transmission_angle (n,) in [0, pi/2] for each loop that is a pin.

    The angle: with a load on the output alone (no mass, no weight), pi/2 less the angle between the force that the loop
    passes on and the velocity of its point. In a four-bar it is the angle of coupler and rocker. Not a number where the
    loop passes no force or its point stands.
    """
    solve = room("pinocchio")
    from mechlab.solve.reactions import loop_wrenches

    plant = solve.PinPlant(m)
    pins = [x for x in m.loops if x.kind in POINT_LOOPS]
    angles = {x.name: np.full(len(poses), np.nan) for x in pins}
    ratio = np.array([float(m.row(output) @ p.u) for p in poses])
    for k, pose in enumerate(poses):
        plant.set(pose.q, pose.u)
        balance = m.row(drive) * ratio[k] - m.row(output)
        pushed = np.linalg.lstsq(plant.jacobian().T, balance, rcond=1e-11)[0]
        wrenches = loop_wrenches(plant, pushed)
        for loop in pins:
            wrench = wrenches[loop.name]
            velocity = plant.kin.velocity(loop.body_b, wrench.point)[:3]
            sizes = float(np.linalg.norm(wrench.force) * np.linalg.norm(velocity))
            if sizes > 1e-12:
                cosine = abs(float(wrench.force @ velocity)) / sizes
                angles[loop.name][k] = float(np.arcsin(min(1.0, cosine)))
    with np.errstate(divide="ignore"):
        advantage = 1.0 / ratio
    columns = {"velocity_ratio": ratio, "mechanical_advantage": advantage}
    units = {"velocity_ratio": "", "mechanical_advantage": ""}
    for name, values in angles.items():
        columns[f"{name}_transmission_angle"], units[f"{name}_transmission_angle"] = values, "rad"
    return columns, units
