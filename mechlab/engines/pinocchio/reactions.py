"""Reactions on Pinocchio: inverse dynamics (drive forces, tooth loads, the wrenches that loops and joints transmit), and the
channels of a run: accelerations, forces of the laws, tooth loads, loop reactions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.dynamics import PinPlant
from mechlab.engines.pinocchio.quantities import Quantities
from mechlab.engines.state import Instant, LoopLoads, MotionForces
from mechlab.errors import NoSolution
from mechlab.experiment.recording import force_unit, over_samples, run_channels
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import FORCES, MOMENTS
from mechlab.mechanism.statics import spring_pull


@dataclass(frozen=True)
class Wrench:
    """A force (3,) [N] and a moment (3,) [N m] about `point` (3,), in world axes; `axes` (3, 3): the local frame to
    world."""

    point: Array
    force: Array
    moment: Array
    axes: Array

    @property
    def local(self) -> tuple[Array, Array]:
        """Force and moment in the axes of the local frame."""
        return self.axes.T @ self.force, self.axes.T @ self.moment


@dataclass(frozen=True)
class InverseDynamics:
    """What a motion needs. drive_forces [N m or N] by joint or shaft; loads: reaction of each relation (torque on the
    joint with coefficient 1); loops: wrench on body b of each loop (body a feels the opposite), in axes of frame a;
    joints: wrench that each joint's body gets from its parent, about the joint, in axes of the joint. accelerations
    (nv,), reactions (rows,).
    """

    accelerations: Array
    reactions: Array
    drive_forces: dict[str, float]
    loads: dict[str, float]
    loops: dict[str, Wrench]
    joints: dict[str, Wrench]


def inverse_dynamics(
    mechanism: Mechanism | PinPlant,
    q: ArrayLike,
    v: ArrayLike,
    accelerations: Mapping[str, float] | None = None,
    drives: Sequence[str] | None = None,
    applied: ArrayLike | None = None,
) -> InverseDynamics:
    """Forces of `drives` (joints or shafts; default: those of the Drives) that give the quantities in `accelerations`
    (default: 0 for every drive) their accelerations, and all reactions. `applied` (nv,): loads besides the drives.

    Solves M a + h = B^T f + J^T r + applied with a from the constraints; the smallest r where rows are redundant.
    Raises NoSolution when these drives cannot make the motion, or the accelerations contradict the constraints.
    """
    plant = mechanism if isinstance(mechanism, PinPlant) else PinPlant(mechanism)
    m = plant.mechanism
    plant.set(q, v)
    names = list(drives if drives is not None else [d.on for d in m.drives])
    given = dict.fromkeys(names, 0.0) if accelerations is None else dict(accelerations)
    items = Quantities(plant.kin, list(given))
    matrix = np.concatenate([plant.jacobian(), items.jacobian()])
    wanted = np.array(list(given.values()), dtype=float) - items.bias()
    a = _least_squares(m, matrix, np.concatenate([-plant.constraint_bias(), wanted]), "accelerations")
    load = np.zeros(m.nv) if applied is None else np.asarray(applied, dtype=float)
    needed = plant.mass_matrix() @ a + plant.bias() - load
    actuation = np.array([m.row(n) for n in names]).reshape(-1, m.nv)
    found = _least_squares(m, np.concatenate([actuation, plant.jacobian()]).T, needed, "forces of these drives")
    forces, reactions = found[: len(names)], found[len(names) :]
    return InverseDynamics(
        accelerations=a,
        reactions=reactions,
        drive_forces=dict(zip(names, forces.tolist(), strict=True)),
        loads=relation_loads(plant, reactions),
        loops=loop_wrenches(plant, reactions),
        joints=joint_wrenches(plant, a, reactions),
    )


def _least_squares(m: Mechanism, matrix: Array, right: Array, what: str) -> Array:
    x = np.linalg.lstsq(matrix, right, rcond=1e-11)[0]
    gap = float(np.max(np.abs(matrix @ x - right), initial=0.0))
    if not gap <= 1e-8 * max(1.0, float(np.max(np.abs(right), initial=0.0))):
        raise NoSolution(
            f"{m.name}: no {what} make this motion here (missed by {gap:.3g}): the position is singular, or the "
            "number of drives and of given accelerations does not fit the degrees of freedom."
        )
    return np.asarray(x)


def relation_loads(plant: PinPlant, reactions: Array) -> dict[str, float]:
    """Reaction of each relation: the load of the teeth, belt or thread, as the torque on the joint of coefficient 1; of a curve that on its
    output."""
    slices = plant.constraints.slices
    return {r.name: float(reactions[slices[r.name]][0]) for r in plant.mechanism.couplings}


def loop_wrenches(plant: PinPlant, reactions: Array) -> dict[str, Wrench]:
    """Wrench on body b of each loop, about the origin of frame b, in world axes; `axes` are those of frame a."""
    if not plant.mechanism.loops:
        return {}
    lines, slices = plant.lines(), plant.constraints.slices
    frames_a, frames_b = plant.constraints.frames()
    out: dict[str, Wrench] = {}
    for k, loop in enumerate(plant.mechanism.loops):
        s = slices[loop.name]
        total = reactions[s] @ lines[s]
        point = frames_b[k, :3, 3]
        out[loop.name] = Wrench(point, total[:3], total[3:] - cross(point, total[:3]), frames_a[k, :3, :3])
    return out


def joint_wrenches(plant: PinPlant, a: Array, reactions: Array) -> dict[str, Wrench]:
    """Wrench that passes through each tree joint, on the body from its parent, about the joint, in world axes.

    By Newton-Euler (pin.rnea) with the loop wrenches and springs as external forces; its component along the joint's
    axis holds what drives, dampers and gear torques do there. A gear relation acts as torques on its joints: the
    radial load of the teeth on the bearings is not in it. Shafts and armatures have no bearings here.
    """
    kin, model, data = plant.kin, plant.kin.model, plant.kin.placed()
    external = [np.zeros(6) for _ in range(model.njoints)]
    for loop in plant.mechanism.loops:
        s = plant.constraints.slices[loop.name]
        total = reactions[s] @ plant.lines()[s]
        external[kin.pin.joint_of[loop.body_b]] += total
        external[kin.pin.joint_of[loop.body_a]] -= total
    for spring in plant.mechanism.springs:
        end_a, end_b, force = spring_pull(kin, spring)
        external[kin.pin.joint_of[spring.body_b]] += np.concatenate([force, cross(end_b, force)])
        external[kin.pin.joint_of[spring.body_a]] -= np.concatenate([force, cross(end_a, force)])
    local = [data.oMi[j].actInv(pin.Force(external[j])) if j else pin.Force.Zero() for j in range(model.njoints)]
    through = kin.work.through_joints(kin.q_pin, plant.v, a, local)
    out: dict[str, Wrench] = {}
    for j in range(1, model.njoints):
        rotation, point = data.oMi[j].rotation.copy(), data.oMi[j].translation.copy()
        out[model.names[j]] = Wrench(point, rotation @ through[j].linear, rotation @ through[j].angular, rotation)
    return out


def motion_forces(
    mechanism: Mechanism, q: Array, v: Array, drive: str, acceleration: float, load: Array
) -> MotionForces:
    """`inverse_dynamics` for one drive at states q (n, nq), v (n, nv) under the constant load (nv,)."""
    m, plant, count = mechanism, PinPlant(mechanism), len(q)
    out = MotionForces(
        np.zeros(count), {x.name: np.zeros((count, 6)) for x in m.loops}, {j.name: np.zeros((count, 6)) for j in m.joints},
        {r.name: np.zeros(count) for r in m.couplings},
    )  # fmt: skip
    for k in range(count):
        found = inverse_dynamics(plant, q[k], v[k], {drive: acceleration}, [drive], load)
        out.drive[k] = found.drive_forces[drive]
        for table, wrenches in ((out.loops, found.loops), (out.joints, found.joints)):
            for name in table.keys() & wrenches.keys():
                table[name][k] = np.concatenate([wrenches[name].force, wrenches[name].moment])
        for name, value in found.loads.items():
            out.relations[name][k] = value
    return out


def loop_loads(mechanism: Mechanism, q: Array, v: Array, force: Array) -> LoopLoads:
    """Solves J^T r + force = 0 for the loops' reactions r, the smallest where rows are redundant, at states q (n, nq),
    v (n, nv)."""
    m, plant = mechanism, PinPlant(mechanism)
    out = LoopLoads(*({x.name: np.zeros((len(q), 3)) for x in m.loops} for _ in range(2)))
    for k in range(len(q)):
        plant.set(q[k], v[k])
        pushed = np.linalg.lstsq(plant.jacobian().T, -force[k], rcond=1e-11)[0]
        wrenches = loop_wrenches(plant, pushed)
        for loop in m.loops:
            wrench = wrenches[loop.name]
            out.force[loop.name][k] = wrench.force
            out.velocity[loop.name][k] = plant.kin.velocity(loop.body_b, wrench.point)[:3]
    return out


def channels(
    plant: PinPlant, t: Array, q: Array, v: Array, instants: Sequence[Instant]
) -> tuple[dict[str, Array], dict[str, str]]:
    """Channels and units of a run, (n,) each, besides the basic ones:

    NAME_accel of every joint and shaft; NAME_force, the sum of the laws on a joint or shaft; RELATION_load, the
    reaction of a relation (torque on the joint of coefficient 1) or curve (on its output); LOOP_fx, _fy, _fz, the force on body b in world
    axes, and _mx, _my, _mz, the moment about frame b, for loops that transmit one.
    """
    m = plant.mechanism
    a, forces = np.array([x.a for x in instants]), over_samples([x.forces for x in instants])
    values, units = run_channels(m, q, v, a, forces)
    for relation in m.relations:
        k = plant.constraints.slices[relation.name].start
        values[f"{relation.name}_load"] = np.array([x.reactions[k] for x in instants])
        units[f"{relation.name}_load"] = force_unit(units[relation.coefficients[0][0]])
    for curve in m.curves:
        k = plant.constraints.slices[curve.name].start
        values[f"{curve.name}_load"] = np.array([x.reactions[k] for x in instants])
        units[f"{curve.name}_load"] = force_unit(units[curve.output])
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
