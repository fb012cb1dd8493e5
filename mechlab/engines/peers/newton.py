"""Newton's Kamino (Warp): bodies in absolute coordinates and single precision, every joint and loop a constraint; beta (Newton 1.8).

Two of its solvers, LOX and DVI, here for one world on the CPU, two steps as one captured graph. Redundant rows are taken without
complaint. Joint equalities (gears, mimic) would be dropped without a word, so that a scene with them is refused before.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from mechlab.engines.peers.job import Job, Pose
from mechlab.experiment.recording import Trace
from mechlab.mechanism.geometry import Array, matrix_to_quaternion
from mechlab.mechanism.model import Mechanism

_compiled: set[tuple[Mechanism, str]] = set()


def prepare(job: Job) -> None:
    """The imports, and the kernels for this size of model: compiled once, which takes many seconds."""
    import warp

    warp.config.quiet = True
    warp.config.enable_backward = False
    import newton  # noqa: F401

    if (job.mechanism, job.integrator) not in _compiled:
        _coordinates(*_build(job)[:2], job.mechanism.nv)
        _compiled.add((job.mechanism, job.integrator))


def run(job: Job) -> Trace:
    """The job; `cpu_s` is that of the captured steps and of the coordinates at the outputs."""
    import warp

    model, state, capture = _build(job)
    turning = np.array([2.0 * np.pi if x.kind == "revolute" else 0.0 for x in job.links.links])
    qs, vs = [job.q], [job.v]
    began = time.thread_time()
    for _ in range(job.outputs):
        for _ in range(_pairs(job)):
            warp.capture_launch(capture.graph)
        q, v = _coordinates(model, state, job.mechanism.nv)
        if not np.all(np.isfinite(q)):
            return Trace(np.array(qs), np.array(vs), time.thread_time() - began, 0, "the state is not finite")
        # angles come back within a turn; the rates say which turn it is
        expected = qs[-1] + 0.5 * (vs[-1] + v) * job.between
        qs.append(q + turning * np.round((expected - q) / (2.0 * np.pi)))
        vs.append(v)
    return Trace(np.array(qs), np.array(vs), time.thread_time() - began, 2 * job.outputs * _pairs(job))


def _pairs(job: Job) -> int:
    """Pairs of steps between two outputs: the two states are exchanged at each step."""
    return max(1, round(job.each / 2))


def _coordinates(model: Any, state: Any, nv: int) -> tuple[Array, Array]:
    import newton
    import warp

    q, v = warp.zeros_like(model.joint_q), warp.zeros_like(model.joint_qd)
    newton.eval_ik(model, state, q, v)
    return q.numpy()[:nv].astype(float), v.numpy()[:nv].astype(float)


def _build(job: Job) -> tuple[Any, Any, Any]:
    """The model, the state at the start, and two captured steps."""
    import newton
    import warp

    model = _model(job)
    solver = newton.solvers.SolverKamino
    stepper = solver(model, config=solver.Config(dynamics_solver=job.integrator.lower()))
    state, other, control = model.state(), model.state(), model.control()
    h = job.between / (2 * _pairs(job))
    loads = control.joint_f.numpy()
    loads[: job.mechanism.nv] = job.loads
    control.joint_f.assign(loads)
    newton.eval_fk(model, model.joint_q, model.joint_qd, state)
    with warp.ScopedCapture(device="cpu") as capture:
        stepper.step(state, other, control, None, h)
        stepper.step(other, state, control, None, h)
    newton.eval_fk(model, model.joint_q, model.joint_qd, state)
    return model, state, capture


def _model(job: Job) -> Any:
    import newton
    import warp

    builder = newton.ModelBuilder(gravity=tuple(job.mechanism.gravity), up_axis=newton.Axis.Z)
    newton.solvers.SolverKamino.register_custom_attributes(builder)
    bodies: list[int] = []
    joints: list[int] = []
    for link in job.links.links:
        i = link.inertia
        bodies.append(
            builder.add_link(
                com=warp.vec3(*i.com), inertia=warp.mat33(*i.matrix().ravel().tolist()), mass=i.mass, lock_inertia=True
            )
        )
        add = builder.add_joint_revolute if link.kind == "revolute" else builder.add_joint_prismatic
        parent = -1 if link.parent < 0 else bodies[link.parent]
        at = _transform(link.pose)
        joints.append(add(parent, bodies[-1], parent_xform=at, axis=(0.0, 0.0, 1.0), armature=0.0, friction=0.0))
    builder.add_articulation(joints)
    for loop in job.mechanism.loops:
        ends = []
        for body, placement in ((loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b)):
            index, pose = job.links.place[body]
            at = _transform(pose @ Pose(placement.rotation, placement.translation))
            ends.append((-1 if index < 0 else bodies[index], at))
        (a, at_a), (b, at_b) = sorted(ends, key=lambda end: end[0] >= 0)  # the world can only be a parent
        if loop.kind == "spherical":
            builder.add_joint_ball(a, b, parent_xform=at_a, child_xform=at_b)
        elif loop.kind == "revolute":
            builder.add_joint_revolute(a, b, parent_xform=at_a, child_xform=at_b, axis=(0.0, 0.0, 1.0))
        else:
            builder.add_joint_fixed(a, b, parent_xform=at_a, child_xform=at_b)
    nv = job.mechanism.nv
    builder.joint_q[:nv], builder.joint_qd[:nv] = job.q.tolist(), job.v.tolist()
    model = builder.finalize(skip_validation_joints=True, device="cpu")
    model.rigid_contact_max = 1  # without it buffers for contacts cost 200 times a step
    return model


def _transform(pose: Pose) -> Any:
    import warp

    w, x, y, z = matrix_to_quaternion(pose.rotation)
    return warp.transform(warp.vec3(*pose.translation.tolist()), warp.quat(x, y, z, w))
