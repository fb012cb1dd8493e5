"""Exudyn: its kinematic tree (minimal coordinates), loops by GenericJoint, spring-dampers between markers.

Exudyn's Jacobian is singular with redundant rows, and with some choices of the rows to leave out it runs on and is silently
wrong (1.13, Bricard's mechanism). It is given the rows that `mechlab.engines.peers.job.independent` finds best conditioned.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from mechlab.engines.peers.exudyn_planar import build, coordinates
from mechlab.engines.peers.job import Job, Links, Pose
from mechlab.experiment.recording import Trace
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import Loop

FULL_NEWTON = ", full Newton"
"""Ending of an integrator's name: the Jacobian is computed anew at every iteration; without it Exudyn's default, modified Newton."""
PLANAR = ", planar bodies"
"""Ending of an integrator's name, before that of the Newton method: see `exudyn_planar`."""
IMPLICIT = {"generalized-alpha": 0.9, "trapezoidal": 1.0}
"""Integrator -> spectral radius at infinity. With 1 and Newmark's formulas it is the trapezoidal rule of index 2."""
ADAPTIVE = ("DOPRI5",)
ALIGNED = 1e-12
_AXES = {"spherical": "111000", "revolute": "111110", "cylindrical": "110110", "prismatic": "110111", "fixed": "111111"}


def prepare(job: Job) -> None:
    """The imports; the module without range checks, as its authors advise."""
    sys.exudynFast = True  # type: ignore[attr-defined]
    import exudyn.itemInterface  # noqa: F401


def run(job: Job) -> Trace:
    """The job; `cpu_s` is that of the solver's steps."""
    import exudyn as exu

    container, system, sensors = _build(exu, job)  # the container must outlive the run
    settings = _settings(exu, job)
    rule = _rule(job)
    if job.integrator in ADAPTIVE:
        return _between_outputs(exu, system, settings, job)
    solver = exu.MainSolverImplicitSecondOrder() if rule in IMPLICIT else exu.MainSolverExplicit()
    solver.InitializeSolver(system, settings)
    spent, reason = _steps(solver, system, settings)
    found = [_stored(system, s) for s in sensors]
    n = min(len(x) for x in found)
    q, v = found if PLANAR not in job.integrator else coordinates(job, *_by_body([x[:n] for x in found]))
    if not reason and n != job.outputs + 1:
        reason = f"it wrote {n} of {job.outputs + 1} outputs"
    return Trace(q[:n], v[:n], spent, (n - 1) * job.each, reason)


def _settings(exu: Any, job: Job) -> Any:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = job.between
    settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
    how = settings.timeIntegration
    how.endTime = job.duration
    how.verboseMode = 0
    if job.integrator in ADAPTIVE:
        how.automaticStepSize = True
        how.relativeTolerance = how.absoluteTolerance = job.value
        how.minimumStepSize = 1e-12
        how.solverType = getattr(exu.DynamicSolverType, job.integrator)
        return settings
    how.numberOfSteps = job.outputs * job.each
    how.automaticStepSize = how.adaptiveStep = False  # outputs must be ends of steps
    rule = _rule(job)
    if rule in IMPLICIT:
        how.generalizedAlpha.spectralRadius = IMPLICIT[rule]
        how.generalizedAlpha.useIndex2Constraints = how.generalizedAlpha.useNewmark = rule == "trapezoidal"
        how.newton.useModifiedNewton = not job.integrator.endswith(FULL_NEWTON)
    else:
        how.solverType = getattr(exu.DynamicSolverType, job.integrator)
    return settings


def _rule(job: Job) -> str:
    """The integrator without what is said of bodies and Newton's method."""
    return job.integrator.removesuffix(FULL_NEWTON).removesuffix(PLANAR)


def _by_body(found: list[Array]) -> tuple[Array, Array]:
    """Coordinates and rates (n, bodies, 3) from the sensors, which alternate."""
    return np.stack(found[0::2], axis=1), np.stack(found[1::2], axis=1)


def _steps(solver: Any, system: Any, settings: Any) -> tuple[float, str]:
    """CPU time of the steps, and why they ended early."""
    reason = ""
    began = time.thread_time()
    try:
        done = solver.SolveSteps(system, settings)
    except Exception as error:  # exudyn raises its own kinds, with a long report
        done, reason = False, (str(error).strip().splitlines() or ["an error"])[0][:200]
    spent = time.thread_time() - began
    if not done and not reason:
        reason = "the solver gave up: " + str(solver.GetErrorString()).strip()[:200]
    return spent, reason


def _between_outputs(exu: Any, system: Any, settings: Any, job: Job) -> Trace:
    """Step by step from output to output: with step control Exudyn does not stop at times of its own accord."""
    data = system.systemData
    how = settings.timeIntegration
    how.numberOfSteps = 1
    qs, vs, spent, reason = [job.q], [job.v], 0.0, ""
    times = np.linspace(0.0, job.duration, job.outputs + 1).tolist()
    for start, end in zip(times[:-1], times[1:], strict=True):
        how.startTime, how.endTime = start, end
        solver = exu.MainSolverExplicit()
        solver.InitializeSolver(system, settings)
        cpu, reason = _steps(solver, system, settings)
        spent += cpu
        if reason:
            break
        solver.FinalizeSolver(system, settings)
        qs.append(np.array(data.GetODE2Coordinates()))
        vs.append(np.array(data.GetODE2Coordinates_t()))
        data.SetODE2Coordinates(qs[-1], configuration=exu.ConfigurationType.Initial)
        data.SetODE2Coordinates_t(vs[-1], configuration=exu.ConfigurationType.Initial)
    return Trace(np.array(qs), np.array(vs), spent, len(qs) - 1, reason)


def _stored(system: Any, sensor: int) -> Array:
    data = np.atleast_2d(np.array(system.GetSensorStoredData(sensor)))
    return data[:, 1:] if data.size else np.zeros((0, 3))


def _build(exu: Any, job: Job) -> tuple[Any, Any, list[Any]]:
    from exudyn import itemInterface as item

    m = job.mechanism
    links = job.links
    container = exu.SystemContainer()
    system = container.AddSystem()
    if PLANAR in job.integrator:
        return container, system, build(exu, item, system, job)
    node = system.AddNode(
        item.NodeGenericODE2(
            referenceCoordinates=[0.0] * m.nv, initialCoordinates=job.q.tolist(), initialCoordinates_t=job.v.tolist(),
            numberOfODE2Coordinates=m.nv,
        )
    )  # fmt: skip
    joints = m.joints
    kinds = {"revolute": exu.JointType.RevoluteZ, "prismatic": exu.JointType.PrismaticZ}
    passive: dict[str, Any] = {}
    if any(j.stiffness or j.damping for j in joints):
        passive = {
            "jointPControlVector": [j.stiffness for j in joints],
            "jointDControlVector": [j.damping for j in joints],
            "jointPositionOffsetVector": [j.spring_rest - j.zero for j in joints],
            "jointVelocityOffsetVector": [0.0] * m.nv,
        }
    tree = system.AddObject(
        item.ObjectKinematicTree(
            nodeNumber=node, gravity=list(m.gravity), baseOffset=[0.0, 0.0, 0.0],
            jointTypes=[kinds[x.kind] for x in links.links], linkParents=[x.parent for x in links.links],
            jointTransformations=exu.Matrix3DList([x.pose.rotation for x in links.links]),
            jointOffsets=exu.Vector3DList([x.pose.translation for x in links.links]),
            linkInertiasCOM=exu.Matrix3DList([x.inertia.matrix() for x in links.links]),
            linkCOMs=exu.Vector3DList([np.array(x.inertia.com) for x in links.links]),
            linkMasses=[x.inertia.mass for x in links.links],
            jointForceVector=job.loads.tolist(), **passive,
        )
    )  # fmt: skip
    ground = system.AddObject(item.ObjectGround())
    for loop in m.loops:
        _close(item, system, links, tree, ground, loop, job.rows[loop.name])
    for s in m.springs:
        ends = [_marker(item, system, tree, ground, *links.point(b, p))
                for b, p in ((s.body_a, s.point_a), (s.body_b, s.point_b))]  # fmt: skip
        system.AddObject(
            item.ObjectConnectorSpringDamper(
                markerNumbers=ends, referenceLength=s.rest_length, stiffness=s.stiffness, damping=s.damping
            )
        )
    kept = [
        system.AddSensor(item.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=x))
        for x in (exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t)
    ]
    system.Assemble()
    return container, system, kept


def _marker(item: Any, system: Any, tree: Any, ground: Any, link: int, point: Array) -> Any:
    if link < 0:
        return system.AddMarker(item.MarkerBodyRigid(bodyNumber=ground, localPosition=point.tolist()))
    made = item.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link, localPosition=point.tolist())
    return system.AddMarker(made)


def _close(item: Any, system: Any, links: Links, tree: Any, ground: Any, loop: Loop, keep: tuple[bool, ...]) -> None:
    markers, rotations = [], []
    for body, placement in ((loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b)):
        link, pose = links.place[body]
        at = pose @ Pose(placement.rotation, placement.translation)
        markers.append(_marker(item, system, tree, ground, link, at.translation))
        rotations.append(at.rotation)
    if loop.kind == "spherical":
        axes = world_axes(links, loop, keep)
        if axes is not None:
            system.AddObject(item.SphericalJoint(markerNumbers=markers, constrainedAxes=axes))
            return
    axes = [int(c) for c in _AXES[loop.kind]]
    system.AddObject(
        item.GenericJoint(
            markerNumbers=markers, constrainedAxes=_kept(loop, axes, keep),
            rotationMarker0=rotations[0], rotationMarker1=rotations[1],
        )
    )  # fmt: skip


def world_axes(links: Links, loop: Loop, keep: tuple[bool, ...]) -> list[int] | None:
    """constrainedAxes of Exudyn's SphericalJoint, whose rows are along the axes of the world, for a spherical loop.

    They are preferred: GenericJoint's rows turn with its first body, which on the velocity level (trapezoidal) makes ten times
    the error. None where a row that is left out does not keep the direction of a world axis.
    """
    link, pose = links.place[loop.body_a]
    if all(keep):
        return [1, 1, 1]
    if sum(keep) != 2:
        return None
    axis = pose.rotation @ Pose(loop.placement_a.rotation, loop.placement_a.translation).rotation[:, keep.index(False)]
    while link >= 0:
        if links.links[link].kind == "revolute" and abs(abs(axis[2]) - 1.0) > ALIGNED:
            return None
        axis, link = links.links[link].pose.rotation @ axis, links.links[link].parent
    along = int(np.argmax(np.abs(axis)))
    return [int(k != along) for k in range(3)] if abs(abs(axis[along]) - 1.0) < ALIGNED else None


def _kept(loop: Loop, axes: list[int], keep: tuple[bool, ...]) -> list[int]:
    """constrainedAxes without the rows that are not kept. Exudyn's row of rotation x is mechlab's "y_z" and so on."""
    order = {"spherical": (0, 1, 2), "revolute": (0, 1, 2, 4, 3), "cylindrical": (0, 1, 4, 3), "prismatic": (0, 1, 4, 3, 5),
             "fixed": (0, 1, 2, 4, 3, 5)}[loop.kind]  # fmt: skip
    out = list(axes)
    for axis, kept in zip(order, keep, strict=True):
        out[axis] = int(kept)
    return out
