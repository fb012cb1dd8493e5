"""Drake's MultibodyPlant: a continuous tree under an error-controlled integrator, or a discrete one with loops.

Drake closes loops only in its discrete SAP model, which is of first order. A ball constraint with the world ends the
process (1.51): loops with the ground go to a body welded to the world.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from mechlab.engines.peers.job import Job, Links, Pose, loop_points
from mechlab.experiment.recording import Trace
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.parts import Loop

DISCRETE = "SAP"
SMALLEST = 1e-14
"""Accuracy below which Drake's error estimate of one step is rounding."""


def prepare(job: Job) -> None:
    """The imports."""
    import pydrake.math
    import pydrake.multibody.plant
    import pydrake.multibody.tree
    import pydrake.systems.analysis  # noqa: F401


def run(job: Job) -> Trace:
    """The job; `cpu_s` is that of the simulator's advance."""
    from pydrake.systems.analysis import Simulator

    h = job.between / job.each if job.integrator == DISCRETE else 0.0
    plant, order_q, order_v = _build(job, h)
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    plant.SetPositions(context, _ordered(job.q, order_q))
    plant.SetVelocities(context, _ordered(job.v, order_v))
    plant.get_applied_generalized_force_input_port().FixValue(context, _ordered(job.loads, order_v))
    if job.integrator != DISCRETE:
        from pydrake.systems.analysis import ResetIntegratorFromFlags

        # the cap on the step must not bind: the largest is the distance of two outputs
        integrator = ResetIntegratorFromFlags(simulator, job.integrator, job.between)
        integrator.set_fixed_step_mode(False)
        integrator.set_target_accuracy(max(job.value, SMALLEST))
        integrator.set_maximum_step_size(job.between)
    simulator.Initialize()
    qs, vs, spent, reason = [job.q], [job.v], 0.0, ""
    for t in np.linspace(0.0, job.duration, job.outputs + 1)[1:]:
        began = time.thread_time()
        try:
            simulator.AdvanceTo(float(t))
        except RuntimeError as error:
            reason = str(error).splitlines()[0][:200]
        spent += time.thread_time() - began
        if reason:
            break
        qs.append(np.asarray(plant.GetPositions(context))[order_q])
        vs.append(np.asarray(plant.GetVelocities(context))[order_v])
    return Trace(np.array(qs), np.array(vs), spent, (len(qs) - 1) * job.each, reason)


def _ordered(values: Array, order: list[int]) -> Array:
    """Values of the mechanism's coordinates in Drake's order."""
    out = np.zeros(len(values))
    out[order] = values
    return out


def _build(job: Job, h: float) -> tuple[Any, list[int], list[int]]:
    from pydrake.multibody import tree as t
    from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant

    m, links = job.mechanism, job.links
    plant = MultibodyPlant(time_step=h)
    if h:
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
        plant.SetUseSampledOutputPorts(False)
    plant.mutable_gravity_field().set_gravity_vector(np.array(m.gravity))
    bodies: list[Any] = []
    joints: list[Any] = []
    for k, (link, joint) in enumerate(zip(links.links, m.joints, strict=True)):
        body = plant.AddRigidBody(f"link_{k}", _inertia(t, link.inertia))
        parent = plant.world_frame() if link.parent < 0 else bodies[link.parent].body_frame()
        frame = plant.AddFrame(t.FixedOffsetFrame(f"at_{k}", parent, _transform(link.pose)))
        kind = t.RevoluteJoint if link.kind == "revolute" else t.PrismaticJoint
        made = plant.AddJoint(kind(link.name, frame, body.body_frame(), [0.0, 0.0, 1.0], damping=joint.damping))
        if joint.stiffness:
            spring = t.RevoluteSpring if link.kind == "revolute" else t.PrismaticSpring
            plant.AddForceElement(spring(made, joint.spring_rest - joint.zero, joint.stiffness))
        bodies.append(body)
        joints.append(made)
    anchor = plant.world_body()
    if any("ground" in (x.body_a, x.body_b) for x in m.loops):
        anchor = plant.AddRigidBody(
            "anchor", _inertia(t, Inertia(1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
        )
        plant.WeldFrames(plant.world_frame(), anchor.body_frame())
    for loop in m.loops:
        _close(plant, links, bodies, anchor, loop)
    for s in m.springs:
        (a, pa), (b, pb) = links.point(s.body_a, s.point_a), links.point(s.body_b, s.point_b)
        ends = [plant.world_body() if x < 0 else bodies[x] for x in (a, b)]
        plant.AddForceElement(t.LinearSpringDamper(ends[0], pa, ends[1], pb, s.rest_length, s.stiffness, s.damping))
    plant.Finalize()
    return plant, [j.position_start() for j in joints], [j.velocity_start() for j in joints]


def _inertia(t: Any, inertia: Inertia) -> Any:
    if not inertia.mass:
        return t.SpatialInertia.Zero()
    xx, yy, zz, xy, xz, yz = inertia.tensor
    central = t.RotationalInertia(xx, yy, zz, xy, xz, yz)
    return t.SpatialInertia.MakeFromCentralInertia(inertia.mass, np.array(inertia.com), central)


def _transform(pose: Pose) -> Any:
    from pydrake.math import RigidTransform, RotationMatrix

    return RigidTransform(RotationMatrix(pose.rotation), pose.translation)


def _close(plant: Any, links: Links, bodies: list[Any], anchor: Any, loop: Loop) -> None:
    ends = []
    for body, placement in ((loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b)):
        link, pose = links.place[body]
        ends.append((anchor if link < 0 else bodies[link], pose @ Pose(placement.rotation, placement.translation)))
    (a, at_a), (b, at_b) = ends
    if loop.kind == "fixed":
        plant.AddWeldConstraint(a, _transform(at_a), b, _transform(at_b))
        return
    for shift in loop_points(links, loop):
        plant.AddBallConstraint(
            a, at_a.translation + at_a.rotation @ shift, b, at_b.translation + at_b.rotation @ shift
        )
