"""Timed runs of any MuJoCo model: two points of every body at even output times; and the observed order of the runs."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mechlab.engines.mujoco.closure import constraint_jacobian
from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.compiled import compiled
from mechlab.engines.mujoco.model_file.guarded import ModelRefused, load_file, load_text
from mechlab.engines.mujoco.model_file.start import start_data
from mechlab.engines.mujoco.trace import step_through
from mechlab.errors import MechlabError
from mechlab.experiment.errors import observed_order, order_finding
from mechlab.experiment.prices import MUJOCO
from mechlab.experiment.recording import Finding
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
    "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
}
FILE_STEPS = 4
"""Steps between two outputs in the coarsest run of an order check of a file."""
HARD = (0.9999, 0.9999, 0.001, 0.5, 2.0)


def integrator_name(model: mujoco.MjModel) -> str:
    """The name of the integrator that a model asks for."""
    return next(n for n, k in INTEGRATORS.items() if k == model.opt.integrator)


def at_timestep(model: mujoco.MjModel, timestep: float) -> mujoco.MjModel:
    """A copy with that timestep [s] and without the automatic reset, so that a blow-up ends a run."""
    out = copy.copy(model)
    out.opt.timestep = timestep
    out.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return out


def harden(model: mujoco.MjModel) -> None:
    """Make all equalities of a model as hard as its timestep allows."""
    model.eq_solref[:] = (2.0 * model.opt.timestep, 1.0)
    model.eq_solimp[:] = HARD


@dataclass(frozen=True)
class FileTrace:
    """points (n, 2 x bodies, 3): centres of mass, and points a radius of gyration beside them, which show rotation;
    energy (n,) [J]; gap: largest residual of an equality; cpu_s of stepping."""

    points: Array
    energy: Array
    gap: float
    cpu_s: float
    steps: int
    reason: str


@dataclass(frozen=True)
class FileModel:
    """A model as its file says; `driven`: with the controls of its first keyframe, else with actuators switched off;
    `push` [rad/s or m/s]: the largest rate that it starts with, all joints forward as far as the equalities allow."""

    model: mujoco.MjModel
    driven: bool = True
    push: float = 0.0

    @property
    def timestep(self) -> float:
        """The timestep of the file [s]."""
        return float(self.model.opt.timestep)

    @property
    def integrator(self) -> str:
        """The integrator of the file."""
        return integrator_name(self.model)

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
    return FileModel(compiled(path))


def trace_file(source: FileModel, integrator: str, hard: bool, duration: float, outputs: int, each: int) -> FileTrace:
    """A run from the first keyframe (or qpos0) in `outputs` x `each` steps. hard: all equalities with solref 2 h and
    impedance .9999 instead of what the file says."""
    model = at_timestep(source.model, duration / outputs / each)
    model.opt.integrator = INTEGRATORS[integrator]
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    if not source.driven:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    if hard:
        harden(model)
    data = start_data(model)
    with engine():
        if source.push:
            data.qvel[:] = _forward(model, data, source.push)
        mujoco.mj_forward(model, data)
        price = MUJOCO.at(model.nv, data.nefc) * (4.0 if integrator == "RK4" else 1.0)
        qpos, qvel, spent, reason = step_through(model, data, outputs, each, price)
        points, energy, gap = np.empty((len(qpos), 2 * model.nbody, 3)), np.empty(len(qpos)), 0.0
        for k, (q, v) in enumerate(zip(qpos, qvel, strict=True)):
            data.qpos[:], data.qvel[:] = q, v
            mujoco.mj_forward(model, data)
            points[k], energy[k] = np.vstack([data.xipos, data.xipos + _beside(model, data)]), data.energy.sum()
            equality = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
            gap = max(gap, float(np.max(np.abs(data.efc_pos[equality]), initial=0.0)))
    return FileTrace(points, energy, gap, spent, (len(qpos) - 1) * each, reason)


def _forward(model: mujoco.MjModel, data: mujoco.MjData, push: float) -> Array:
    """(nv,) rates: equal ones, less what the equalities forbid, the largest of them `push`."""
    mujoco.mj_forward(model, data)
    rows = constraint_jacobian(model, data)[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
    rates = np.ones(model.nv) - np.linalg.pinv(rows, rcond=1e-9) @ rows.sum(axis=1)
    return np.asarray(push * rates / max(float(np.abs(rates).max(initial=0.0)), 1e-12))


def _beside(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """(bodies, 3) from the centres of mass to points a radius of gyration away, along the diagonal of the principal axes."""
    mass = np.maximum(model.body_mass, 1e-12)
    radius = np.sqrt(0.5 * model.body_inertia.sum(axis=1) / mass / 3.0)
    return np.asarray(data.ximat.reshape(-1, 3, 3).sum(axis=2) * radius[:, None])


def file_order(run: Callable[[str, bool, int], Any], model: Any, hard: bool, between: float) -> Finding:
    """The finding "order" of RK4 on any MuJoCo model: run(integrator, hard, steps between two outputs) gives a FileTrace."""
    step = between / FILE_STEPS

    def points(h: float) -> Array:
        found = run("RK4", hard, round(between / h))
        return np.asarray(found.points).reshape(len(found.points), -1)

    expected = 2 if hard else 4
    suspects = {
        "an actuator with a state (activation), which MuJoCo integrates in first order beside RK4": model.na,
        "dry friction": np.any(model.dof_frictionloss) or np.any(model.tendon_frictionloss),
        "contacts": np.any(model.geom_contype) and model.ngeom > 1,
        "limits": np.any(model.jnt_limited) or np.any(model.tendon_limited),
        "soft constraints, which switch on and off or have a width": model.neq,
    }
    return order_finding(
        observed_order(points, step, expected), step, [text for text, there in suspects.items() if there]
    )


def compile_file(source: Path | str) -> tuple[mujoco.MjModel | None, str]:
    """The model of an MJCF or URDF file (a Path), or of a text; or None and MuJoCo's words when it refuses it, or what happened when
    it crashes."""
    try:
        return load_file(source) if isinstance(source, Path) else load_text(source), ""
    except ModelRefused as error:
        return None, str(error)
