"""Timed runs of any MuJoCo model, whatever it holds: centres of mass of all bodies at even output times."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import Array
from mechlab.simulate.control import compiling, engine
from mechlab.simulate.trace import step_through

INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
    "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
}
HARD = (0.9999, 0.9999, 0.001, 0.5, 2.0)


@dataclass(frozen=True)
class FileTrace:
    """points (n, bodies, 3): centres of mass; energy (n,) [J]; gap: largest residual of an equality; cpu_s of stepping."""

    points: Array
    energy: Array
    gap: float
    cpu_s: float
    steps: int
    reason: str


@dataclass(frozen=True)
class FileModel:
    """A model as its file says; `driven`: with the controls of its first keyframe, else with actuators switched off."""

    model: mujoco.MjModel
    driven: bool = True

    @property
    def timestep(self) -> float:
        """The timestep of the file [s]."""
        return float(self.model.opt.timestep)

    @property
    def integrator(self) -> str:
        """The integrator of the file."""
        return next(n for n, k in INTEGRATORS.items() if k == self.model.opt.integrator)

    @property
    def extent(self) -> float:
        """Size of the model [m]."""
        return float(self.model.stat.extent)

    @property
    def has_equalities(self) -> bool:
        """Whether there are loops, welds, gears to harden."""
        return bool(self.model.neq)


def read_model(path: Path) -> FileModel:
    """The model of an MJCF file; raises MechlabError with MuJoCo's words when it refuses the file."""
    if not path.is_file():
        raise MechlabError(f"there is no file {path}.")
    try:
        with compiling():
            return FileModel(mujoco.MjModel.from_xml_path(str(path)))
    except ValueError as error:
        raise MechlabError(f"{path}: MuJoCo refuses the model: {error}") from None


def trace_file(source: FileModel, integrator: str, hard: bool, duration: float, outputs: int, each: int) -> FileTrace:
    """A run from the first keyframe (or qpos0) in `outputs` x `each` steps. hard: all equalities with solref 2 h and
    impedance .9999 instead of what the file says."""
    import copy

    model = copy.copy(source.model)
    h = duration / outputs / each
    model.opt.timestep, model.opt.integrator = h, INTEGRATORS[integrator]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    if not source.driven:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    if hard:
        model.eq_solref[:] = (2.0 * h, 1.0)
        model.eq_solimp[:] = HARD
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    with engine():
        qpos, qvel, spent, reason = step_through(model, data, outputs, each)
        points, energy, gap = np.empty((len(qpos), model.nbody, 3)), np.empty(len(qpos)), 0.0
        for k, (q, v) in enumerate(zip(qpos, qvel, strict=True)):
            data.qpos[:], data.qvel[:] = q, v
            mujoco.mj_forward(model, data)
            points[k], energy[k] = data.xipos, data.energy.sum()
            equality = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
            gap = max(gap, float(np.max(np.abs(data.efc_pos[equality]), initial=0.0)))
    return FileTrace(points, energy, gap, spent, (len(qpos) - 1) * each, reason)
