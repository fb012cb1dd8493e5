"""OpenSim on Simbody: pin and slider joints, loops by point and weld constraints, integrators that project.

Simbody takes redundant rows (it factors with a rank), so every loop is given as it is.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from mechlab.engines.peers.job import Job, Links, Pose, loop_points
from mechlab.experiment.recording import Trace
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import Spring

_X_TO_Z = Pose(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), np.zeros(3))
"""A slider of OpenSim runs along x of its frames, a link's along z."""


def prepare(job: Job) -> None:
    """The imports."""
    import opensim  # noqa: F401


def run(job: Job) -> Trace:
    """The job; `cpu_s` is that of the manager's integration."""
    import opensim as osim

    osim.Logger.setLevelString("off")
    model, coordinates = _build(osim, job)
    state = model.initSystem()
    for c, q, v in zip(coordinates, job.q.tolist(), job.v.tolist(), strict=True):
        c.setValue(state, q, False)
        c.setSpeedValue(state, v)
    manager = osim.Manager(model)
    manager.setWriteToStorage(False)
    manager.setPerformAnalyses(False)
    manager.setIntegratorMethod(getattr(osim.Manager, f"IntegratorMethod_{job.integrator}"))
    manager.setIntegratorAccuracy(job.value)
    state.setTime(0.0)
    manager.initialize(state)
    qs, vs, spent, reason = [job.q], [job.v], 0.0, ""
    for t in np.linspace(0.0, job.duration, job.outputs + 1)[1:].tolist():
        began = time.thread_time()
        try:
            state = manager.integrate(t)
        except RuntimeError as error:
            reason = (str(error).strip().splitlines() or ["the integrator failed"])[0][:200]
        spent += time.thread_time() - began
        if reason:
            break
        qs.append(np.array([c.getValue(state) for c in coordinates]))
        vs.append(np.array([c.getSpeedValue(state) for c in coordinates]))
    return Trace(np.array(qs), np.array(vs), spent, len(qs) - 1, reason)


def _build(osim: Any, job: Job) -> tuple[Any, list[Any]]:
    m, links = job.mechanism, job.links
    model = osim.Model()
    model.setName("job")
    model.setGravity(osim.Vec3(*m.gravity))
    bodies: list[Any] = []
    coordinates: list[Any] = []
    for k, (link, joint) in enumerate(zip(links.links, m.joints, strict=True)):
        i = link.inertia
        body = osim.Body(f"link_{k}", i.mass, osim.Vec3(*i.com), osim.Inertia(*i.tensor))
        model.addBody(body)
        parent = model.getGround() if link.parent < 0 else bodies[link.parent]
        turn = _X_TO_Z if link.kind == "prismatic" else Pose(np.eye(3), np.zeros(3))
        kind = osim.PinJoint if link.kind == "revolute" else osim.SliderJoint
        made = kind(f"joint_{k}", parent, *_place(osim, link.pose @ turn), body, *_place(osim, turn))
        coordinate = made.updCoordinate()
        coordinate.setName(f"q_{k}")
        coordinate.setRangeMin(-1e6)
        coordinate.setRangeMax(1e6)
        coordinate.set_clamped(False)
        model.addJoint(made)
        bodies.append(body)
        coordinates.append(coordinate)
        load, stiffness, damping = float(job.loads[k]), joint.stiffness, joint.damping
        if load:
            model.addForce(osim.ExpressionBasedCoordinateForce(f"q_{k}", repr(load)))
        if stiffness or damping:
            spring = osim.SpringGeneralizedForce(f"q_{k}")
            spring.setStiffness(stiffness)
            spring.setRestLength(joint.spring_rest - joint.zero)
            spring.setViscosity(damping)
            model.addForce(spring)
    for s in m.springs:
        model.addForce(_spring(osim, model, links, bodies, s))
    for loop in m.loops:
        ends = []
        for body, placement in ((loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b)):
            index, pose = links.place[body]
            at = pose @ Pose(placement.rotation, placement.translation)
            ends.append((model.getGround() if index < 0 else bodies[index], at))
        (a, at_a), (b, at_b) = ends
        if loop.kind == "fixed":
            weld = osim.WeldConstraint(loop.name, a, *_place(osim, at_a), b, *_place(osim, at_b))
            model.addConstraint(weld)
            continue
        for shift in loop_points(links, loop):
            points = [osim.Vec3(*(x.translation + x.rotation @ shift).tolist()) for x in (at_a, at_b)]
            model.addConstraint(osim.PointConstraint(a, points[0], b, points[1]))
    model.finalizeConnections()
    return model, coordinates


def _spring(osim: Any, model: Any, links: Links, bodies: list[Any], s: Spring) -> Any:
    (a, pa), (b, pb) = links.point(s.body_a, s.point_a), links.point(s.body_b, s.point_b)
    ends = [model.getGround() if x < 0 else bodies[x] for x in (a, b)]
    points = [osim.Vec3(*p.tolist()) for p in (pa, pb)]
    if not s.damping:
        return osim.PointToPointSpring(ends[0], points[0], ends[1], points[1], s.stiffness, s.rest_length)
    force = osim.ExpressionBasedPointToPointForce()
    names = [e.getAbsolutePathString() for e in ends]
    force.set_body1(names[0])
    force.set_body2(names[1])
    force.setPoint1(points[0])
    force.setPoint2(points[1])
    force.setExpression(f"{s.stiffness!r}*(d-{s.rest_length!r})+{s.damping!r}*ddot")
    return force


def _place(osim: Any, pose: Pose) -> tuple[Any, Any]:
    return osim.Vec3(*pose.translation.tolist()), osim.Vec3(*body_xyz(pose.rotation))


def body_xyz(rotation: Array) -> tuple[float, float, float]:
    """Angles (a, b, c) [rad] of the rotation Rx(a) Ry(b) Rz(c)."""
    r = rotation
    cosine = math.hypot(r[0, 0], r[0, 1])
    b = math.atan2(r[0, 2], cosine)
    if cosine < 1e-9:
        return math.atan2(r[2, 1], r[1, 1]), b, 0.0
    return math.atan2(-r[1, 2], r[2, 2]), b, math.atan2(-r[0, 1], r[0, 0])
