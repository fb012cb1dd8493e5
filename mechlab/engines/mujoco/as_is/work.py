"""Energy of a run of a file: potential and kinetic as the engine computes them, and the work of all other forces, step by step.

    E(t) - E(0) = work of actuators, contacts, stops, loops, dry friction, dampers, fluids and applied loads

What is left over is energy that the steps made or lost: the sign of a timestep that is too large. The work of a step is

    h f_k . (v_k + v_k+1) / 2        semi-implicit methods: the forces f at the start of the step, dampers that are taken
                                     implicitly at its end
    (P_k + P_k+1) h / 2, P = f . v   RK4: powers at the last stage of each step
"""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.engines.mujoco.as_is.controls import FileControls
from mechlab.engines.mujoco.stepping import Grid
from mechlab.mechanism.geometry import Array

BLOCK = 64
"""Steps whose forces are kept before their work is summed up."""
INTEGRATOR = mujoco.mjtIntegrator
IMPLICIT = tuple(int(x) for x in (INTEGRATOR.mjINT_IMPLICIT, INTEGRATOR.mjINT_IMPLICITFAST, INTEGRATOR.mjINT_DISCRETE))


class WorkMeter:
    """Steps a model, each step under the controls of its start, and sums up the work of all forces that have no potential.

    `done` [J]: net work since the start; `turned` [J]: the sum of the absolute work of actuators, constraints and passive forces.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, controls: FileControls) -> None:
        self._controls = controls
        self._asked = np.zeros((BLOCK, model.nv))
        self.done, self.turned = 0.0, 0.0
        nv = model.nv
        self._sources = (
            data.qfrc_actuator,
            data.qfrc_constraint,
            data.qfrc_passive,
            data.qfrc_spring,
            data.qfrc_applied,
        )
        self._forces = np.zeros((len(self._sources), BLOCK, nv))
        self._rates = np.zeros((BLOCK + 1, nv))
        self._last: Array | None = None
        self._multistage = int(model.opt.integrator) == int(INTEGRATOR.mjINT_RK4)
        self._damping = implicit_damping(model)
        if self._multistage:
            mujoco.mj_forward(model, data)
            self._last = self._powers(np.array([[s] for s in self._sources]), data.qvel[None])[:, 0]

    def step(self, model: mujoco.MjModel, data: mujoco.MjData, steps: Grid, start: int, end: int) -> None:
        """From step number `start` to `end` of a grid; the last step of the grid may be shorter."""
        step, h, rates, forces, qvel = mujoco.mj_step, steps.timestep, self._rates, self._forces, data.qvel
        rows = [(f, s) for f, s in zip(forces, self._sources, strict=True)]
        last = steps.duration - (steps.count - 1) * h
        whole = steps.count if last >= h * (1.0 - 1e-9) else steps.count - 1
        k = start
        while k < end:
            many = min(BLOCK, end - k) if k >= whole else min(BLOCK, end - k, whole - k)
            if k >= whole:
                model.opt.timestep = last
            try:
                rates[0] = qvel
                for i in range(many):
                    if self._controls:
                        self._command(model, data, steps.t(k + i), i)
                    step(model, data)
                    rates[i + 1] = qvel
                    for block, now in rows:
                        block[i] = now
            finally:
                model.opt.timestep = h
            self._add(many, last if k >= whole else h)
            k += many

    def _command(self, model: mujoco.MjModel, data: mujoco.MjData, t: float, i: int) -> None:
        """Controls of time t; of a method with stages also the actuators' forces under them, for the work of step i of the block."""
        self._controls.put(data, t)
        if self._multistage:
            mujoco.mj_fwdActuation(model, data)
            self._asked[i] = data.qfrc_actuator

    def _add(self, n: int, h: float) -> None:
        forces, rates = self._forces[:, :n], self._rates[: n + 1]
        if self._multistage:
            assert self._last is not None
            powers = np.concatenate([self._last[:, None], self._powers(forces, rates[1:])], axis=1)
            work = 0.5 * h * (powers[:, 1:] + powers[:, :-1])
            if self._controls:  # they jump from step to step
                work[0] = 0.5 * h * (powers[0, 1:] + np.einsum("ij,ij->i", self._asked[:n], rates[:-1]))
            self._last = powers[:, -1]
        else:
            work = h * self._powers(forces, 0.5 * (rates[1:] + rates[:-1]))
            slower = self._damping * (rates[1:] - rates[:-1])
            work[2] -= 0.5 * h * np.einsum("ij,ij->i", slower, rates[1:] + rates[:-1])
        self.done += float(np.sum(work))
        self.turned += float(np.sum(np.abs(work)))

    @staticmethod
    def _powers(forces: Array, rates: Array) -> Array:
        """(4, n) powers of actuators, constraints, passive forces without springs, and applied loads."""
        actuator, constraint, passive, spring, applied = np.einsum("kij,ij->ki", forces, rates)
        return np.array([actuator, constraint, passive - spring, applied])


def implicit_damping(model: mujoco.MjModel) -> Array:
    """(nv,) damping that the integrator takes at the end of a step: of joints, and of actuators on joints."""
    integrator, opt = int(model.opt.integrator), model.opt
    out = np.zeros(model.nv)
    if opt.disableflags & mujoco.mjtDisableBit.mjDSBL_DAMPER:
        return out
    euler = integrator == int(INTEGRATOR.mjINT_EULER)
    if euler and not opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP or integrator in IMPLICIT:
        out += model.dof_damping
    if integrator in IMPLICIT:
        for k in range(model.nu):
            joint = int(model.actuator_trnid[k, 0])
            simple = int(model.actuator_trntype[k]) == int(mujoco.mjtTrn.mjTRN_JOINT) and model.jnt_type[joint] >= 2
            if simple and int(model.actuator_biastype[k]) == int(mujoco.mjtBias.mjBIAS_AFFINE):
                out[model.jnt_dofadr[joint]] -= model.actuator_gear[k, 0] ** 2 * model.actuator_biasprm[k, 2]
    return out


def energy(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[float, float]:
    """Potential energy (gravity, springs) and kinetic energy [J] of an evaluated state."""
    mujoco.mj_energyPos(model, data)
    mujoco.mj_energyVel(model, data)
    return float(data.energy[0]), float(data.energy[1])
