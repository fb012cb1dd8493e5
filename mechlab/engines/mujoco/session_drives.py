"""The declared drives as a session commands them: names, units, ranges, forces and work from the states it kept.

A command is physical, or in the units of the file that a drive was read from (`Control`):

    servo    force = stiffness (target - value) - damping rate      command: the target
    speed    force = damping (target - rate)                        command: the target rate, of a drive with damping alone
    motor    force = command                                        command: the force
    winding  force = constant x current                             command: the voltage
    file     force = gear (gain command + push) - stiffness value - damping rate

The control of the engine's actuator is scale x command + shift.

Work is integrated between kept states, a time H apart, under the command that was held, by Simpson's rule. The middle of the interval
follows from both ends: x = (x0 + x1) / 2 + H (v0 - v1) / 8 and v = 3 (x1 - x0) / (2 H) - (v0 + v1) / 4, of fourth order in H;
the work of a constant force is exact.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.engines.mujoco.model import MujocoMap
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import is_length
from mechlab.mechanism.parts import Drive


class SessionDrives:
    """See the module. names, units (drives,); rest, low, high (drives,): the command at which a drive holds its declared target or
    gives no force, and the useful range; `clamped`: commands beyond the range of a file's control are cut off."""

    def __init__(self, map_: MujocoMap) -> None:
        m, model = map_.mechanism, map_.model
        self.map, self.model = map_, model
        drives = m.drives
        self.names = tuple(d.name for d in drives)
        self.units = tuple(_unit(d, is_length(m, d.on)) for d in drives)
        joints = {j.name: j for j in m.joints}
        ways = [_way(model, k, d, m.zero(d.on)) for k, d in enumerate(drives)]
        self.scale, self.shift = (np.array([w[i] for w in ways]) for i in range(2))
        self.rest = np.array([w[2] for w in ways])
        ranges = (model.actuator_ctrlrange.reshape(-1, 2) - self.shift[:, None]) / self.scale[:, None]
        ranges = np.sort(ranges, axis=1)
        for k, drive in enumerate(drives):
            joint = joints.get(drive.on)
            if drive.control is not None and drive.control.range is not None:
                ranges[k] = drive.control.range
            elif drive.control is None and drive.stiffness and drive.winding is None:
                if joint is not None and joint.range is not None:
                    ranges[k] = joint.range
        self.low, self.high = ranges[:, 0].copy(), ranges[:, 1].copy()
        self.clamped = np.array([d.control is not None and d.control.range is not None for d in drives], dtype=bool)
        self._windings = np.array([d.winding is not None for d in drives], dtype=bool)
        self._electric = [(d.winding.constant, d.winding.resistance) if d.winding else (0.0, 1.0) for d in drives]
        self.on = tuple(d.on for d in drives)
        self._rows = np.array([m.row(d.on) for d in drives]).reshape(len(drives), m.nv)
        self._columns = map_.qpos[m.q_columns]
        limits = model.actuator_forcerange.reshape(-1, 2)
        limited = model.actuator_forcelimited.astype(bool)
        self.limits = np.where(limited[:, None], limits, [-np.inf, np.inf])

    @property
    def plain(self) -> bool:
        """Whether controls are commands plus `shift`."""
        return not np.any(self.clamped) and not np.any(self.scale != 1.0)

    def control(self, command: Array) -> Array:
        """(..., drives) controls of the engine for commands."""
        cut = np.where(self.clamped, np.clip(command, self.low, self.high), command)
        return np.asarray(self.scale * cut + self.shift)

    def command(self, control: Array) -> Array:
        """(..., drives) commands for controls of the engine."""
        return np.asarray((control - self.shift) / self.scale)

    def forces(self, value: Array, rate: Array, control: Array, current: Array) -> Array:
        """(n, drives) forces at coordinates `value` (less the zero) and rates, (n, drives) each, under controls (n, drives) of the
        engine and its activations (n, na)."""
        model = self.model
        gain, bias = model.actuator_gainprm[:, 0], model.actuator_biasprm[:, :3]
        affine = np.asarray(model.actuator_biastype == mujoco.mjtBias.mjBIAS_AFFINE)
        gear = model.actuator_gear[:, 0]
        spring = (bias[:, 0] + bias[:, 1] * gear * value + bias[:, 2] * gear * rate) * affine
        out = np.asarray(gain * control + spring)
        for k in np.flatnonzero(self._windings):
            constant, resistance = self._electric[k]
            if model.actuator_actnum[k]:
                out[:, k] = constant * current[:, model.actuator_actadr[k]]
            else:
                out[:, k] = constant / resistance * (control[:, k] - constant * gear[k] * rate[:, k])
        damping = np.asarray(model.actuator_damping).reshape(len(out.T), -1)[:, 0] if out.size else 0.0
        return np.asarray(gear * np.clip(out, self.limits[:, 0], self.limits[:, 1]) - damping * rate)

    def at(self, rows: Array) -> tuple[Array, Array, Array, Array]:
        """Values, rates, controls (n, drives) each, and activations (n, na), of kept rows (n, size)."""
        nq, nv, na = self.model.nq, self.model.nv, self.model.na
        value = rows[:, 1 + self._columns] @ self._rows.T
        rate = rows[:, 1 + nq + self.map.dof] @ self._rows.T
        return value, rate, rows[:, rows.shape[1] - len(self.names) :], rows[:, 1 + nq + nv : 1 + nq + nv + na]

    def work(self, rows: Array) -> tuple[Array, Array]:
        """(n - 1,) work [J] of all drives between each of n kept rows and the next, by Simpson's and by the trapezoidal rule; the
        command of an interval stands in the row at its end."""
        if not self.names:
            return np.zeros(len(rows) - 1), np.zeros(len(rows) - 1)
        x, v, control, current = self.at(rows)
        held = np.diff(rows[:, 0])[:, None]
        middle_x = 0.5 * (x[1:] + x[:-1]) + held / 8.0 * (v[:-1] - v[1:])
        middle_v = 1.5 * (x[1:] - x[:-1]) / held - 0.25 * (v[:-1] + v[1:])
        u, middle_i = control[1:], 0.5 * (current[1:] + current[:-1])
        first = self.forces(x[:-1], v[:-1], u, current[:-1]) * v[:-1]
        middle = self.forces(middle_x, middle_v, u, middle_i) * middle_v
        last = self.forces(x[1:], v[1:], u, current[1:]) * v[1:]
        simpson = (held / 6.0 * (first + 4.0 * middle + last)).sum(axis=1)
        return simpson, (held / 2.0 * (first + last)).sum(axis=1)


def _way(model: mujoco.MjModel, k: int, drive: Drive, zero: float) -> tuple[float, float, float]:
    """Scale and shift from a command to the control of actuator k, and the command at rest.

    The actuator gives gear (gain u + b0) and, with the coordinate instead of the physical value, the terms of stiffness and
    damping; what the command asks for at the coordinate 0 is put equal to it.
    """
    if drive.winding is not None:
        return 1.0, 0.0, 0.0
    gear, gain = float(model.actuator_gear[k, 0]), float(model.actuator_gainprm[k, 0])
    push = float(model.actuator_biasprm[k, 0]) if model.actuator_biastype[k] == mujoco.mjtBias.mjBIAS_AFFINE else 0.0
    c, target = drive.control, zero if drive.target is None else drive.target
    per_command = c.gear * c.gain if c is not None else drive.stiffness or drive.damping or 1.0
    constant = (c.gear * c.push if c is not None else 0.0) - drive.stiffness * zero
    scale, shift = per_command / (gear * gain), (constant / gear - push) / gain
    at_rest = (drive.stiffness * (target - zero) - constant) / per_command if drive.stiffness else 0.0
    return scale, shift, at_rest


def _unit(drive: Drive, slides: bool) -> str:
    """Unit of the command of a drive; "control" for that of a file."""
    if drive.control is not None:
        return "control"
    if drive.winding is not None:
        return "V"
    if drive.stiffness:
        return "m" if slides else "rad"
    if drive.damping:
        return "m/s" if slides else "rad/s"
    return "N" if slides else "N m"
