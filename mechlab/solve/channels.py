"""Channels of a run on Pinocchio: accelerations, forces of the laws, tooth loads, loop reactions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechlab.experiment.recording import basic_channels
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.solve.dynamics import PinPlant
from mechlab.solve.equations import Instant
from mechlab.solve.reactions import loop_wrenches

FORCES, MOMENTS = ("fx", "fy", "fz"), ("mx", "my", "mz")


def channels(
    plant: PinPlant, t: Array, q: Array, v: Array, instants: Sequence[Instant]
) -> tuple[dict[str, Array], dict[str, str]]:
    """Channels and units of a run, (n,) each, besides the basic ones:

    NAME_accel of every joint and shaft; NAME_force, the sum of the laws on a joint or shaft; RELATION_load, the
    reaction of a relation (torque on the joint of coefficient 1); LOOP_fx, _fy, _fz, the force on body b in world
    axes, and _mx, _my, _mz, the moment about frame b, for loops that transmit one.
    """
    m = plant.mechanism
    values, units = basic_channels(m, q, v)
    a = np.array([x.a for x in instants])
    for name in m.scalar_names:
        values[f"{name}_accel"] = a @ m.row(name)
        units[f"{name}_accel"] = f"{units[name]}/s2"
    for name in dict.fromkeys(n for x in instants for n in x.forces):
        values[f"{name}_force"] = np.array([x.forces.get(name, 0.0) for x in instants])
        units[f"{name}_force"] = _force_unit(units[name])
    for relation in m.relations:
        k = plant.constraints.slices[relation.name].start
        values[f"{relation.name}_load"] = np.array([x.reactions[k] for x in instants])
        units[f"{relation.name}_load"] = _force_unit(units[relation.coefficients[0][0]])
    _loops(plant, t, q, v, instants, values, units)
    return values, units


def _loops(
    plant: PinPlant,
    t: Array,
    q: Array,
    v: Array,
    instants: Sequence[Instant],
    values: dict[str, Array],
    units: dict[str, str],
) -> None:
    m: Mechanism = plant.mechanism
    if not m.loops:
        return
    table = np.empty((len(t), len(m.loops), 6))
    for i, now in enumerate(instants):
        wrenches = loop_wrenches(plant.set(q[i], v[i], t[i]), now.reactions)
        table[i] = [np.concatenate([w.force, w.moment]) for w in wrenches.values()]
    for k, loop in enumerate(m.loops):
        turning = loop.kind not in ("spherical", "distance")
        for j, part in enumerate((*FORCES, *MOMENTS) if turning else FORCES):
            values[f"{loop.name}_{part}"] = table[:, k, j]
            units[f"{loop.name}_{part}"] = "N" if part in FORCES else "N m"


def _force_unit(coordinate: str) -> str:
    return "N" if coordinate == "m" else "N m"
