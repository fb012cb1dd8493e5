"""A short run of the file as it is, compared with one that has hard rows, small steps and the better integrator.

The difference is how far off the motion is, which the file itself does not show. The run starts from the first keyframe (or the
reference pose); where nothing would move, it starts with a push along the motions that the rows allow.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.rows import Start, active, free_push, started
from mechlab.engines.mujoco.model_file.trace import FILE_STEPS, INTEGRATORS, FileTrace, at_timestep, file_order, harden
from mechlab.engines.mujoco.trace import step_through
from mechlab.experiment.recording import Finding, Symptom
from mechlab.mechanism.geometry import Array

DURATION, MOST_STEPS, OUTPUTS = 0.5, 500, 20
"""The run lasts DURATION [s], or MOST_STEPS of the file's steps if that is less."""
WRONG, DOUBTFUL = 1e-2, 1e-3
"""Error over the extent of the motion: an error of the file above WRONG, a warning above DOUBTFUL."""
STILL = 1e-2
"""Motion, over the size of the model, below which a run says nothing."""
SURE = 3.0
"""The finer run is a reference only where its own error is smaller by this factor than the difference to it."""


@dataclass(frozen=True)
class TrialRun:
    """error [m]: of the centres of mass in a run as the file says; own [m]: error of the reference run itself; duration
    [s]: simulated time; reason: why the run of the file ended early; better: integrator of the reference run, "" when
    none completed; moved [m]: extent of the motion."""

    error: float
    own: float
    duration: float
    reason: str
    better: str
    moved: float
    observed: Finding | None = None

    def symptoms(self) -> Iterator[Symptom]:
        """Finding "trial"."""
        if self.reason:
            rest = f"; {self.better} with hard rows comes through" if self.better else ""
            yield Symptom("trial", "error", f"a run of {self.duration:.3g} s as the file says {self.reason}{rest}.")
            return
        if not self.better:
            return
        text = (
            f"in a run of {self.duration:.3g} s the file as it is differs by {self.error:.2g} m from {self.better} with hard rows "
            f"and a quarter of the step ({100 * self.error / self.moved:.2g} % of its motion; the finer run is known to {self.own:.1g} m)"
        )
        if self.error < SURE * self.own and self.error > DOUBTFUL * self.moved:
            yield Symptom(
                "trial", "warning", f"{text}: contacts, friction or chaos; neither run can be trusted to that."
            )
        elif self.error > WRONG * self.moved:
            yield Symptom("trial", "error", f"{text}.")
        elif self.error > DOUBTFUL * self.moved:
            yield Symptom("trial", "warning", f"{text}.")

    def order(self) -> Iterator[Symptom]:
        """Finding "lost_order": RK4 with hard rows should be of order 2, without rows of order 4."""
        if self.observed is not None and self.observed.severity != "ok":
            yield Symptom("lost_order", "warning", f"RK4: {self.observed.sentence}.")


def run_trial(model: mujoco.MjModel) -> TrialRun:
    """The runs; see the module."""
    h = float(model.opt.timestep)
    each = max(1, min(MOST_STEPS, round(DURATION / h)) // OUTPUTS)
    size, length = max(float(model.stat.extent), 1e-9), OUTPUTS * each * h
    with engine():
        start = _start(model, size, h, each)
        as_is, reason = _run(model, start, h, OUTPUTS, each)
        for better in ("RK4", "discrete"):
            fine, failed = _run(model, start, h / 4, OUTPUTS, 4 * each, better)
            if failed:
                continue
            moved = max(_extent(fine), STILL * size)
            own = _apart(fine, _run(model, start, h / 2, OUTPUTS, 2 * each, better)[0])
            observed = _order(model, start, OUTPUTS * each // FILE_STEPS) if better == "RK4" else None
            return TrialRun(_apart(as_is, fine), own, length, reason, better, moved, observed)
    return TrialRun(np.inf, np.inf, length, reason, "", size)


def _order(model: mujoco.MjModel, start: Start, outputs: int) -> Finding:
    """The order of RK4 at the timestep of the file, its half and quarter."""
    between = FILE_STEPS * float(model.opt.timestep)

    def run(name: str, hard: bool, each: int) -> FileTrace:
        points, reason = _run(model, start, between / each, max(1, outputs), each, name)
        return FileTrace(points, np.zeros(len(points)), 0.0, 0.0, 0, reason)

    return file_order(run, model, bool(active(model)), between)


def _start(model: mujoco.MjModel, size: float, h: float, each: int) -> Start:
    """qpos, qvel, ctrl of the start."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    qpos, qvel, ctrl = np.array(data.qpos), np.array(data.qvel), np.array(data.ctrl)
    if _extent(_run(model, (qpos, qvel, ctrl), h, OUTPUTS, each)[0]) > STILL * size:
        return qpos, qvel, ctrl
    if not np.any(qvel):
        mujoco.mj_forward(model, data)
        qvel = free_push(model, qpos, size)
    return qpos, qvel, ctrl


def _run(model: mujoco.MjModel, start: Start, h: float, outputs: int, each: int, better: str = "") -> tuple[Array, str]:
    """(n, bodies, 3) centres of mass, and why it ended early. better: this integrator, with hard rows; else as in the file."""
    model = at_timestep(model, h)
    if better:
        model.opt.integrator, model.opt.jacobian = INTEGRATORS[better], mujoco.mjtJacobian.mjJAC_DENSE
        model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
        harden(model)
    data = started(model, start)
    poses, _, _, reason = step_through(model, data, outputs, each)
    points = np.empty((len(poses), model.nbody, 3))
    for k, q in enumerate(poses):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        points[k] = data.xipos
    return points, reason


def _extent(points: Array) -> float:
    return float(np.max(np.ptp(points, axis=0), initial=0.0))


def _apart(a: Array, b: Array) -> float:
    n = min(len(a), len(b))
    return float(np.max(np.linalg.norm(a[:n] - b[:n], axis=2), initial=0.0))
