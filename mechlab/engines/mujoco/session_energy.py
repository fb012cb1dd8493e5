"""Work of the drives and losses of the dampers along the kept states of a session.

Between two kept states lies one action. Where the drives move much within it, so that Simpson's rule and the trapezoidal rule over
its ends disagree, the action is stepped once more from its kept start, and every timestep is looked at. What was not stepped again
is an allowance in the energy balance.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from mechlab.engines.mujoco.control import controlled, engine
from mechlab.engines.mujoco.drive import Driver
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.mujoco.session_kept import Kept
from mechlab.experiment.energy import dissipation, work
from mechlab.mechanism.geometry import Array

RESOLVED = 1e-5
"""Disagreement of the two rules, as a share of the work of all actions, above which an action is stepped again."""
FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS


def energy_fed(session: Kept, a: int, b: int, again: bool) -> tuple[Array, float]:
    """(b - a,) energy [J] that drives less dampers have fed since kept state a, at each later one up to b; and the allowance [J].

    again: actions that are not resolved are stepped once more; else they make up the allowance.
    """
    rows = session.rows[a : b + 1]
    simpson, trapezoid = session.drives.work(rows)
    gap = np.abs(simpson - trapezoid)
    coarse = np.flatnonzero(gap > RESOLVED * float(np.sum(np.abs(simpson))))
    if not again or session.substeps == 1:
        allowance = float(np.sum(gap[coarse])) if session.substeps > 1 else 0.0
        lost = _lost(session, rows)
        return np.cumsum(simpson) - lost[1:], allowance
    finer = {int(k): rows_between for k, rows_between in zip(coarse, _stepped(session, rows, coarse), strict=True)}
    series = [rows[:1]]
    ends = []
    done = simpson.copy()
    for k in range(len(rows) - 1):
        if k in finer:
            done[k] = session.drives.work(np.concatenate([rows[k : k + 1], finer[k], rows[k + 1 : k + 2]]))[0].sum()
            series.append(finer[k])
        series.append(rows[k + 1 : k + 2])
        ends.append(sum(len(part) for part in series) - 1)
    return np.cumsum(done) - _lost(session, np.concatenate(series))[ends], 0.0


def _lost(session: Kept, rows: Array) -> Array:
    """(n,) energy [J] that dampers and dry friction of the mechanism have taken since the first row."""
    s, nq, nv = session, session.model.nq, session.model.nv
    q, v = s.map.coordinates(rows[:, 1 : 1 + nq]), s.map.rates(rows[:, 1 + nq : 1 + nq + nv])
    return work(rows[:, 0], dissipation(s.mechanism, q, v))


def _stepped(session: Kept, rows: Array, which: NDArray[np.intp]) -> list[Array]:
    """For each action k the kept rows after its timesteps but the last, stepped from row k under the command of row k + 1."""
    s, model = session, session.model
    data = mujoco.MjData(model)
    driver = Driver(s.mechanism, s.scene.laws, MujocoPlant(s.mechanism, model, data, s.map))
    size, controls = mujoco.mj_stateSize(model, FULL), rows.shape[1] - model.nu
    out = []
    with controlled(data, driver) if driver.called else engine():
        for k in which:
            mujoco.mj_setState(model, data, rows[k][:size], FULL)
            data.ctrl[:] = rows[k + 1, controls:]
            states = np.tile(rows[k + 1], (s.substeps - 1, 1))
            for state in states:
                mujoco.mj_step(model, data)
                mujoco.mj_getState(model, data, state[:size], FULL)
            out.append(states)
    return out
