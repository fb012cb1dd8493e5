"""MuJoCo Warp: MuJoCo's algorithms in single precision, here for one world on the CPU, a step as one captured graph.

It is made for thousands of worlds on a GPU; of one world it says what its arithmetic reaches. Loops are as hard as in our own
runs of MuJoCo (solref 2h, solimp .9999): at the defaults they do not converge. It refuses a model that switches `autoreset` off
(4.0), so that flag is taken back.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from mechlab.engines.peers.job import Job
from mechlab.experiment.recording import Trace
from mechlab.mechanism.model import Mechanism

_compiled: set[tuple[Mechanism, str]] = set()


def prepare(job: Job) -> None:
    """The imports, and the kernels for this size of model: compiled once, which takes many seconds."""
    import warp

    warp.config.quiet = True
    warp.config.enable_backward = False
    if (job.mechanism, job.integrator) not in _compiled:
        warp.capture_launch(_build(job)[-1].graph)
        _compiled.add((job.mechanism, job.integrator))


def run(job: Job) -> Trace:
    """The job; `cpu_s` is that of the captured steps and the copies of their states."""
    import warp

    qpos, dof, data, capture = _build(job)
    qs, vs = [job.q], [job.v]
    began = time.thread_time()
    for _ in range(job.outputs):
        for _ in range(job.each):
            warp.capture_launch(capture.graph)
        qs.append(data.qpos.numpy()[0, qpos].astype(float))
        vs.append(data.qvel.numpy()[0, dof].astype(float))
        if not np.all(np.isfinite(qs[-1])):
            return Trace(np.array(qs[:-1]), np.array(vs[:-1]), time.thread_time() - began, 0, "the state is not finite")
    return Trace(np.array(qs), np.array(vs), time.thread_time() - began, job.outputs * job.each)


def _build(job: Job) -> tuple[list[int], list[int], Any, Any]:
    """Addresses of the coordinates and rates, the data at the start, and the captured step."""
    import mujoco
    import mujoco_warp
    import warp

    model = mujoco.MjModel.from_xml_string(job.mjcf)
    model.opt.timestep = job.between / job.each
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    if model.nv != job.mechanism.nv:
        raise ValueError("its MJCF has bodies of its own between the sides of a loop")
    joints = [model.joint(j.name) for j in job.mechanism.joints]
    qpos, dof = [int(j.qposadr[0]) for j in joints], [int(j.dofadr[0]) for j in joints]
    data = mujoco.MjData(model)
    data.qpos[qpos], data.qvel[dof], data.qfrc_applied[dof] = job.q, job.v, job.loads
    mujoco.mj_forward(model, data)
    there, state = mujoco_warp.put_model(model), mujoco_warp.put_data(model, data)
    with warp.ScopedCapture(device="cpu") as capture:
        mujoco_warp.step(there, state)
    return qpos, dof, state, capture
