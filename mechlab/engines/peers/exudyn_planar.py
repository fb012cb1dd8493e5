"""Exudyn with planar bodies: three absolute coordinates for each link, every joint and loop a constraint.

For mechanisms in the plane of x and y Exudyn's own examples take this form; a step costs half of one of the kinematic tree, at
about the same error. The frame of a body has the axes of the world at the start, its origin in the centre of mass.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechlab.engines.peers.job import Job, Links
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

FLAT = 1e-12
Body = int


def why_not_planar(mechanism: Mechanism, links: Links) -> str:
    """What keeps a mechanism from being made of planar bodies; empty where nothing does."""
    turned: list[Array] = []
    for link in links.links:
        rotation = link.pose.rotation if link.parent < 0 else turned[link.parent] @ link.pose.rotation
        turned.append(rotation)
        upright = abs(rotation[2, 2])
        if abs(upright - 1.0) > FLAT if link.kind == "revolute" else upright > FLAT:
            return f"the joint {link.name} does not move in the plane of x and y"
        if not link.inertia.mass:
            return f"the link of {link.name} has no mass"
    for joint in mechanism.joints:
        if joint.stiffness or joint.damping:
            return f"the joint {joint.name} has a spring or damper, which planar joints have not"
    for loop in mechanism.loops:
        if loop.kind != "spherical":
            return f"the {loop.kind} loop {loop.name} is not a pin in the plane"
    return ""


@dataclass(frozen=True)
class _Start:
    """A link at the start of the run, in world axes: rotation (3, 3), its joint (3,) and centre of mass (3,) [m], the rate of
    rotation (3,), the velocities of joint and centre (3,), and the axis (3,) of its joint."""

    rotation: Array
    joint: Array
    centre: Array
    turning: Array
    joint_rate: Array
    centre_rate: Array
    axis: Array


def starts(job: Job) -> list[_Start]:
    """Every link at the start."""
    out: list[_Start] = []
    for link, q, v in zip(job.links.links, job.q.tolist(), job.v.tolist(), strict=True):
        rotation, joint, turning, rate = np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3)
        if link.parent >= 0:
            p = out[link.parent]
            rotation, joint, turning, rate = p.rotation, p.joint, p.turning, p.joint_rate
        arm = rotation @ link.pose.translation
        rotation, joint, rate = rotation @ link.pose.rotation, joint + arm, rate + np.cross(turning, arm)
        axis = rotation[:, 2]
        if link.kind == "revolute":
            c, s = np.cos(q), np.sin(q)
            rotation = rotation @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            turning = turning + v * axis
        else:
            joint, rate = joint + q * axis, rate + v * axis + np.cross(turning, q * axis)
        arm = rotation @ np.array(link.inertia.com)
        out.append(_Start(rotation, joint, joint + arm, turning, rate, rate + np.cross(turning, arm), axis))
    return out


def build(exu: Any, item: Any, system: Any, job: Job) -> list[Any]:
    """The bodies, joints, loops, springs and loads; a sensor of the coordinates and one of the rates of each body."""
    ground = system.AddObject(item.ObjectGround())
    at = starts(job)
    bodies: list[Body] = []
    sensors: list[Any] = []
    for link, s in zip(job.links.links, at, strict=True):
        inertia = (s.rotation @ link.inertia.matrix() @ s.rotation.T)[2, 2]
        node = system.AddNode(
            item.NodeRigidBody2D(
                referenceCoordinates=[s.centre[0], s.centre[1], 0.0],
                initialVelocities=[s.centre_rate[0], s.centre_rate[1], s.turning[2]],
            )
        )
        bodies.append(
            system.AddObject(item.ObjectRigidBody2D(nodeNumber=node, mass=link.inertia.mass, inertia=inertia))
        )
        weight = (link.inertia.mass * np.array(job.mechanism.gravity)).tolist()
        centre = system.AddMarker(item.MarkerBodyPosition(bodyNumber=bodies[-1]))
        system.AddLoad(item.LoadForceVector(markerNumber=centre, loadVector=weight))
        kinds = exu.OutputVariableType
        for kind in (kinds.Coordinates, kinds.Coordinates_t):
            sensors.append(
                system.AddSensor(
                    item.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind)
                )
            )

    def marker(kind: Any, link: int, point: Array) -> Any:
        body, local = (ground, point) if link < 0 else (bodies[link], point - at[link].centre)
        return system.AddMarker(kind(bodyNumber=body, localPosition=[local[0], local[1], 0.0]))

    def world(body: str, point: tuple[float, float, float]) -> tuple[int, Array]:
        link, local = job.links.point(body, point)
        return link, local if link < 0 else at[link].joint + at[link].rotation @ local

    for k, (link, s) in enumerate(zip(job.links.links, at, strict=True)):
        if link.kind == "revolute":
            ends = [marker(item.MarkerBodyPosition, x, s.joint) for x in (link.parent, k)]
            system.AddObject(item.ObjectJointRevolute2D(markerNumbers=ends))
        else:
            ends = [marker(item.MarkerBodyRigid, x, s.joint) for x in (link.parent, k)]
            across = [-s.axis[1], s.axis[0], 0.0]
            system.AddObject(
                item.ObjectJointPrismatic2D(markerNumbers=ends, axisMarker0=s.axis.tolist(), normalMarker1=across)
            )
        for x, sign in ((k, 1.0), (link.parent, -1.0)):
            if job.loads[k] and x >= 0:
                on, load = marker(item.MarkerBodyRigid, x, s.joint), (sign * job.loads[k] * s.axis).tolist()
                kind = item.LoadTorqueVector if link.kind == "revolute" else item.LoadForceVector
                system.AddLoad(kind(markerNumber=on, loadVector=load))
    for loop in job.mechanism.loops:
        pairs = ((loop.body_a, loop.placement_a.position), (loop.body_b, loop.placement_b.position))
        ends = [marker(item.MarkerBodyPosition, *world(b, p)) for b, p in pairs]
        system.AddObject(item.ObjectJointRevolute2D(markerNumbers=ends))
    for spring in job.mechanism.springs:
        pairs = ((spring.body_a, spring.point_a), (spring.body_b, spring.point_b))
        ends = [marker(item.MarkerBodyPosition, *world(b, p)) for b, p in pairs]
        system.AddObject(
            item.ObjectConnectorSpringDamper(
                markerNumbers=ends,
                referenceLength=spring.rest_length,
                stiffness=spring.stiffness,
                damping=spring.damping,
            )
        )
    system.Assemble()
    return sensors


def coordinates(job: Job, moved: Array, rates: Array) -> tuple[Array, Array]:
    """q (n, nv) and v (n, nv) from the displacements and rates (n, links, 3) of the bodies: x, y [m] and angle [rad]."""
    at, n = starts(job), len(moved)
    q, v = np.empty((n, len(at))), np.empty((n, len(at)))
    still = np.zeros((n, 3))
    for k, (link, s) in enumerate(zip(job.links.links, at, strict=True)):
        p = link.parent
        own, parent = (moved[:, k], rates[:, k]), (still, still) if p < 0 else (moved[:, p], rates[:, p])
        if link.kind == "revolute":
            sign = np.sign(s.axis[2])
            q[:, k], v[:, k] = job.q[k] + sign * (own[0] - parent[0])[:, 2], sign * (own[1] - parent[1])[:, 2]
            continue
        here, speed = _point(*own, s.centre, s.joint)
        there, carried = _point(*parent, np.zeros(3) if p < 0 else at[p].centre, s.joint)
        c, sn = np.cos(parent[0][:, 2]), np.sin(parent[0][:, 2])
        axis = np.stack([c * s.axis[0] - sn * s.axis[1], sn * s.axis[0] + c * s.axis[1]], axis=1)
        q[:, k] = job.q[k] + np.sum(axis * (here - there), axis=1)
        across = np.stack([-axis[:, 1], axis[:, 0]], axis=1) * parent[1][:, 2:]
        v[:, k] = np.sum(axis * (speed - carried) + across * (here - there), axis=1)
    return q, v


def _point(moved: Array, rate: Array, centre: Array, point: Array) -> tuple[Array, Array]:
    """Place and velocity (n, 2) of a point of a body that was at `point` at the start."""
    c, s = np.cos(moved[:, 2]), np.sin(moved[:, 2])
    x, y = point[:2] - centre[:2]
    arm = np.stack([c * x - s * y, s * x + c * y], axis=1)
    return centre[:2] + moved[:, :2] + arm, rate[:, :2] + rate[:, 2:] * np.stack([-arm[:, 1], arm[:, 0]], axis=1)
