"""Accelerations and forces of rigid equality rows, at a state that MuJoCo has evaluated with soft ones.

The engine's row is a spring and damper with compliance R behind it:

    J a + R f = aref,       aref = -b J v - k d r - dJ/dt v

The motion of a run converges to that of rigid rows; a and f at one state do not: where a run starts, R leaves some 1 - d of the force
out; and inside a step of RK4 the stages leave the constraint by h^2 / 8 (J a), which a row of the time constant 2 h answers with 1 / 32 of
that acceleration, at any h, and the rates of the samples make up for it. Here the same state is solved again with rows that have neither
spring nor damper, by the method of multipliers:

    J a' + R f' = R f - dJ/dt v      until      J a' + dJ/dt v = R (f - f')      is SMALL beside the accelerations

One pass leaves R / (R + J M^-1 J^T) of the error, 1e-4 to 1e-2. How many it takes is seen at one of MEASURED samples. Rows that repeat
others share their load as the engine shares it; friction and the ends of ranges are solved along.
"""

from __future__ import annotations

import math

import mujoco

from mechlab.engines.mujoco.model import MujocoMap
from mechlab.mechanism.geometry import Array

SMALL, PASSES, MEASURED = 1e-6, 4, 16
"""What is left, as a share of the accelerations: the rates of the samples are off by 1e-5 themselves. Most passes for it, and of how many
samples one is measured."""
EXACT, MANY = 1e-10, 20
"""The same for a state asked alone."""
IMPLICIT = (mujoco.mjtIntegrator.mjINT_IMPLICIT, mujoco.mjtIntegrator.mjINT_IMPLICITFAST)


class HardRows:
    """See the module. The integrator `discrete` has no accelerations of a state, only differences of rates: it is left alone."""

    def __init__(self, map_: MujocoMap, small: float = SMALL, passes: int = PASSES) -> None:
        self._small, self._most = small, passes
        self.model, self._curves = map_.model, map_.curves
        self._discrete = self.model.opt.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE
        self._implicit = self.model.opt.integrator in IMPLICIT
        self._before: tuple[Array, Array | None] | None = None
        self._passes, self._samples = 1, 0

    def solve(self, data: mujoco.MjData) -> None:
        """Put accelerations (`qacc`) and row forces of rigid rows into the data, after mj_forward; `put_back` undoes what a step that
        goes on from there would see. The rows have no stiffness and damping (`efc_KBIP`) afterwards."""
        count, model = data.ne, self.model
        if not count or self._discrete:
            return
        self._before = data.qacc.copy(), data.qfrc_constraint.copy() if self._implicit else None
        terms, wanted, compliance, force = data.efc_KBIP, data.efc_aref, data.efc_R, data.efc_force
        if len(wanted) > count:
            terms, wanted, compliance, force = terms[:count], wanted[:count], compliance[:count], force[:count]
        terms.fill(0.0)
        mujoco.mj_referenceConstraint(model, data)  # efc_aref = -dJ/dt v
        if self._curves:
            self._curves.put(data)
        measured = not self._samples % MEASURED
        self._samples += 1
        allowed = self._small * math.hypot(*data.qacc.tolist()) if measured else 0.0
        rest = given = compliance * force
        for k in range(self._most if measured else self._passes):
            wanted += rest
            mujoco.mj_fwdConstraint(model, data)
            if not measured and k + 1 == self._passes:
                break
            found = compliance * force
            rest, given = found - given, found
            if measured:
                self._passes = k + 1
                if math.hypot(*rest.tolist()) <= allowed:
                    break

    def put_back(self, data: mujoco.MjData) -> None:
        """Accelerations and joint forces of the soft rows again: a step goes on from the first with RK4, from both if it is implicit."""
        if self._before is not None:
            data.qacc[:], forces = self._before
            if forces is not None:
                data.qfrc_constraint[:] = forces
            self._before = None
