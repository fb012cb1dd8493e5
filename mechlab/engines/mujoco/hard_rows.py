"""Accelerations and forces of rigid equality rows, at a state that MuJoCo has evaluated with soft ones.

The engine's row is a spring and damper with compliance R behind it:

    J a + R f = aref,       aref = -b J v - k d r - dJ/dt v

The motion of a run converges to that of rigid rows; a and f at one state do not: where a run starts, R leaves some 1 - d of the force
out; and inside a step of RK4 the stages leave the constraint by h^2 / 8 (J a), which a row of the time constant 2 h answers with 1 / 32 of
that acceleration, at any h, and the rates of the samples make up for it. Here the same state is solved again with rows that have neither
spring nor damper, by the method of multipliers:

    J a' + R f' = R f - dJ/dt v      until      J a' + dJ/dt v = R (f - f')      is SMALL beside the accelerations

One pass leaves R / (R + J M^-1 J^T) of the error, 1e-4 to 1e-2. Rows that repeat others share their load as the engine shares it;
friction and the ends of ranges are solved along.
"""

from __future__ import annotations

import math

import mujoco

from mechlab.mechanism.geometry import Array

SMALL, PASSES = 1e-8, 4


class HardRows:
    """See the module. The integrator `discrete` has no accelerations of a state, only differences of rates: it is left alone."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self._discrete = int(model.opt.integrator) == int(mujoco.mjtIntegrator.mjINT_DISCRETE)
        self._soft: dict[int, tuple[Array, Array]] = {}
        self._before: tuple[Array, Array] | None = None

    def solve(self, data: mujoco.MjData) -> None:
        """Put accelerations (`qacc`) and row forces of rigid rows into the data, after mj_forward; `put_back` undoes what a step that
        goes on from there would see."""
        count = data.ne
        if not count or self._discrete:
            return
        self._before = data.qacc.copy(), data.qfrc_constraint.copy()
        if count not in self._soft:  # they change with the settings alone
            terms = data.efc_KBIP[:count]
            self._soft[count] = terms[:, 0] * terms[:, 2], terms[:, 1].copy()
        stiffness, damping = self._soft[count]
        rigid = data.efc_aref[:count] + stiffness * data.efc_pos[:count] + damping * data.efc_vel[:count]
        compliance, force = data.efc_R[:count], data.efc_force[:count]
        allowed = SMALL * math.hypot(*data.qacc.tolist())
        for _ in range(PASSES):
            given = compliance * force
            data.efc_aref[:count] = rigid + given
            mujoco.mj_fwdConstraint(self.model, data)
            if math.hypot(*(given - compliance * force).tolist()) <= allowed:
                break

    def put_back(self, data: mujoco.MjData) -> None:
        """Accelerations and joint forces of the soft rows again: a step goes on from the first with RK4, from both if it is implicit."""
        if self._before is not None:
            data.qacc[:], data.qfrc_constraint[:] = self._before
            self._before = None
