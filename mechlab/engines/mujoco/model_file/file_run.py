"""One run of a model file: as the file says, or with hard rows and a better integrator; from its first keyframe, bounded in work.

The cost of a step is counted by its numbers of coordinates and rows, not by a clock: what is examined does not depend on the machine.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import mujoco
import numpy as np

from mechlab.engines.mujoco.engine_warnings import words_of
from mechlab.engines.mujoco.model_file.rows import loops
from mechlab.engines.mujoco.model_file.start import start_data
from mechlab.engines.mujoco.model_file.trace import HARD, INTEGRATORS, at_timestep
from mechlab.engines.state import RATE_LIMIT
from mechlab.experiment.prices import MUJOCO
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

OUTPUTS = 20
WATCHED = 4
"""Steps after which a run is looked at: in a blow-up, everything touches everything and a step may take a thousand times as long."""
SHAPE = 7e-7
"""Counted work of a shape in the search for contacts [s]."""
_BAD = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
_FULL = (mujoco.mjtWarning.mjWARN_CONTACTFULL, mujoco.mjtWarning.mjWARN_CNSTRFULL)
_ROW = mujoco.mjtConstraint


@dataclass(frozen=True)
class FileRun:
    """points (n, bodies, 3): centres of mass at even times; energy (n,) [J], potential and kinetic; gap [m, rad]: largest residual
    of a loop or coupling, `gaps` by equality; touched: what acted at an output besides the loops ("contacts", "limits",
    "dry friction"); rows: the largest number; reason: why it ended early, "" when it did not; full: how often the memory
    for contacts and for rows was full, so that some were left out."""

    points: Array
    energy: Array
    gaps: dict[int, float]
    touched: frozenset[str]
    rows: int
    fastest: float
    reason: str
    full: tuple[int, int]

    @property
    def gap(self) -> float:
        """Largest residual of a loop or coupling [m, rad]."""
        return max(self.gaps.values(), default=0.0)

    @property
    def moved(self) -> float:
        """Extent of the motion [m]."""
        return float(np.max(np.ptp(self.points, axis=0), initial=0.0))

    def apart(self, other: FileRun) -> float:
        """Largest distance of a centre of mass between two runs [m]."""
        n = min(len(self.points), len(other.points))
        return float(np.max(np.linalg.norm(self.points[:n] - other.points[:n], axis=2), initial=0.0))

    def energy_off(self, other: FileRun) -> float:
        """Largest difference of the energies of two runs [J]."""
        n = min(len(self.energy), len(other.energy))
        return float(np.max(np.abs(self.energy[:n] - other.energy[:n]), initial=0.0))


def moving_size(model: mujoco.MjModel) -> float:
    """Size of what moves [m]: floors and terrain do not count, as they do in MuJoCo's extent."""
    data = start_data(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    moves = [b for b in range(1, model.nbody) if model.body_weldid[b]]
    radius = max((float(model.geom_rbound[g]) for g in range(model.ngeom) if model.body_weldid[model.geom_bodyid[g]]), default=0.0)
    spread = float(np.max(np.ptp(np.vstack([data.xipos[moves], data.xanchor]), axis=0))) if moves else 0.0
    return max(min(float(model.stat.extent), spread + 2.0 * radius), 1e-9)


def price(model: mujoco.MjModel, rows: int) -> float:
    """Counted work of a step as the file says [s]."""
    once = MUJOCO.at(model.nv, rows) + SHAPE * model.ngeom
    return once * (4.0 if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4 else 1.0)


def prepared(model: mujoco.MjModel, h: float, better: str = "") -> mujoco.MjModel:
    """A copy with the timestep h and without the automatic reset. better: this integrator, with hard loops; else as the file says."""
    model = at_timestep(model, h)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    if better:
        model.opt.integrator = INTEGRATORS[better]
        if loops(model):
            model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
            model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
        for k in loops(model):
            model.eq_solref[k] = (2.0 * h, 1.0)
            model.eq_solimp[k] = HARD
    return model


def run_file(model: mujoco.MjModel, each: int, outputs: int = OUTPUTS, push: Array | None = None) -> FileRun:
    """A run of a prepared model over `outputs` x `each` steps; push (nv,): rates added to those of the start."""
    data = start_data(model)
    if push is not None:
        data.qvel[:] += push
    points, energy = np.empty((outputs + 1, model.nbody, 3)), np.empty(outputs + 1)
    gaps: dict[int, float] = {}
    kinds: set[int] = set()
    rows, fastest, reason, k = 0, 0.0, "", 0
    try:
        for k in range(outputs + 1):
            for done in range(0, each if k else 0, WATCHED):
                mujoco.mj_step(model, data, nstep=min(WATCHED, each - done))
                fastest = max(fastest, float(np.max(np.abs(data.qvel), initial=0.0)))
                if not fastest < RATE_LIMIT or any(data.warning[w].number for w in _BAD):
                    reason = f"diverged before t = {data.time:.4g} s"
                    break
                kinds.update(data.efc_type.tolist())
            if reason:
                break
            mujoco.mj_forward(model, data)
            points[k], energy[k], rows = data.xipos, data.energy.sum(), max(rows, int(data.nefc))
            kinds.update(data.efc_type.tolist())
            _widen(gaps, data)
        else:
            k += 1
    except mujoco.FatalError as error:
        reason = f"ended before t = {data.time + each * model.opt.timestep:.4g} s, the engine gave up ({words_of(error)})"
    full = (int(data.warning[_FULL[0]].number), int(data.warning[_FULL[1]].number))
    return FileRun(points[:k], energy[:k], gaps, _acting(kinds), rows, fastest, reason, full)


def _acting(kinds: set[int]) -> frozenset[str]:
    named = {
        "dry friction": (_ROW.mjCNSTR_FRICTION_DOF, _ROW.mjCNSTR_FRICTION_TENDON),
        "limits": (_ROW.mjCNSTR_LIMIT_JOINT, _ROW.mjCNSTR_LIMIT_TENDON),
        "contacts": (_ROW.mjCNSTR_CONTACT_FRICTIONLESS, _ROW.mjCNSTR_CONTACT_PYRAMIDAL, _ROW.mjCNSTR_CONTACT_ELLIPTIC),
    }
    return frozenset(name for name, which in named.items() if kinds & {int(w) for w in which})


def _widen(gaps: dict[int, float], data: mujoco.MjData) -> None:
    equality = data.efc_type == _ROW.mjCNSTR_EQUALITY
    for k, x in zip(data.efc_id[equality], np.abs(data.efc_pos[equality]), strict=True):
        gaps[int(k)] = max(gaps.get(int(k), 0.0), float(x))


Found = TypeVar("Found")


def tried(skipped: list[str], what: str, work: Callable[[], Found]) -> Found | None:
    """What `work` finds; None, and a line in `skipped`, where the engine gives up or the linear algebra does not converge."""
    try:
        return work()
    except (mujoco.FatalError, np.linalg.LinAlgError, ValueError) as error:
        skipped.append(f"{what}: {words_of(error)}")
        return None
