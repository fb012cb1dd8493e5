"""The linear equations of a mechanism about a pose that its drives hold, with the commands of the drives as inputs.

In coordinates y of the motions that the constraints allow, displacement = basis y with N^T M N = 1:

    x = (y, y'),  u = commands less those that hold the pose:    x' = A x + B u,   A = [[0, 1], [-K, -C]],  B = [0; N^T gains]

K has the geometric stiffness of the reactions (`mechlab.studies.modes.eigen.linear`). A regulator of (A, B) is one of the closed
mechanism: `state` gives x from coordinates and rates, so that commands = at_rest - gain @ state(q, v).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError, NoSolution, Untrustworthy
from mechlab.experiment.laws import Law, Servo
from mechlab.experiment.motion import Hold
from mechlab.experiment.scene import initial_pose
from mechlab.lab.design import Design, with_extra
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array, quaternion_to_matrix, rotation_log
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Drive
from mechlab.mechanism.structure import structure
from mechlab.studies.modes.eigen import Dynamics, linear

UNHELD = 1e-9
"""Share of the forces at rest that the drives may leave unbalanced: rounding."""


@dataclass(frozen=True)
class LinearModel:
    """x' = A x + B u about a pose; see the module.

    A (2 f, 2 f), B (2 f, drives), of f freedoms; q (nq,) the pose; `at_rest` (drives,): commands that hold it, in the units of a session;
    `drives`: their names; basis (nv, f); mass (nv, nv).
    """

    mechanism: Mechanism
    A: Array
    B: Array
    q: Array
    at_rest: Array
    drives: tuple[str, ...]
    basis: Array
    mass: Array

    def state(self, q: ArrayLike, v: ArrayLike) -> Array:
        """(2 f,) x = (y, y') at coordinates q (nq,) and rates v (nv,), `session.state`: y = N^T M displacement."""
        q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
        weigh = self.basis.T @ self.mass
        return np.concatenate([weigh @ self._displacement(q), weigh @ v])

    def _displacement(self, q: Array) -> Array:
        """(nv,) from the pose to q; of a spherical joint the rotation vector in its moving axes."""
        out = np.zeros(self.mechanism.nv)
        for joint in self.mechanism.joints:
            a, b = self.mechanism.q_slice[joint.name], self.mechanism.v_slice[joint.name]
            if joint.nv == 1:
                out[b] = q[a] - self.q[a]
            else:
                here, there = quaternion_to_matrix(self.q[a]), quaternion_to_matrix(q[a])
                out[b] = rotation_log(here.T @ there)
        return out


def linear_model(
    design: Design, fidelity: str | None, values: Mapping[str, float], witness: str = "pinocchio"
) -> LinearModel:
    """See `mechlab.api.sessions.linearize`."""
    chosen = fidelity or next(f for f in (design.entry.default_fidelity, *design.entry.fidelities) if f != "kinematic")
    m = design.mechanism(chosen)
    if not m.drives:
        raise MechlabError(
            f"{m.name}: it has no drives, so there is nothing to command; declare one with Builder.drive."
        )
    still = replace(design.scene(None, chosen), laws=(), initial={}, initial_rates={})
    scene = with_extra(design, still, values)
    q = initial_pose(m, scene.initial, m.name)
    dynamics: Dynamics = engine(witness).small_motions(m, scene.laws)
    x = dynamics.pose(q)
    free = linear(dynamics, x, with_damping=False)
    if free.basis.shape[1] != structure(m).freedoms:
        raise Untrustworthy(
            f"{m.name}: this pose is singular; small motions about it are not linear. Give another one (X_0=...)."
        )
    rates = dynamics.rates(free.basis)
    rows = np.array([m.row(d.on) for d in m.drives])
    held = np.linalg.lstsq((rows @ rates).T, free.gradient, rcond=1e-11)[0]
    left = float(np.max(np.abs((rows @ rates).T @ held - free.gradient), initial=0.0))
    if left > max(UNHELD, 1e-7 * float(np.max(np.abs(free.gradient), initial=0.0))) * max(1.0, free.load):
        raise NoSolution(
            f"{m.name}: its drives cannot hold this pose at rest: in the motions that they do not move, a force remains "
            f"({left:.3g} per unit of kinetic coordinates). ml.modes finds poses of rest; give one as X_0=..."
        )
    ways = [_way(m, d, float(m.value(d.on, q)), float(f)) for d, f in zip(m.drives, held, strict=True)]
    dynamics = engine(witness).small_motions(m, (*scene.laws, *(law for law, _, _ in ways)))
    found = linear(dynamics, x)
    basis, count = dynamics.rates(found.basis), found.basis.shape[1]
    gains = np.array([gain for _, gain, _ in ways])
    upper = np.hstack([np.zeros((count, count)), np.eye(count)])
    lower = np.hstack([-found.stiffness, -found.damping])
    inputs = np.vstack([np.zeros((count, len(gains))), basis.T @ (rows.T * gains)])
    mass = engine("numpy").state(m, q).mass_matrix
    at_rest = np.array([command for _, _, command in ways])
    return LinearModel(m, np.vstack([upper, lower]), inputs, q, at_rest, tuple(d.name for d in m.drives), basis, mass)


def _way(m: Mechanism, drive: Drive, value: float, force: float) -> tuple[Law, float, float]:
    """The drive as a law that gives `force` at rest, its force per command, and the command at rest."""
    if drive.winding is not None:
        w = drive.winding
        if not w.constant:
            raise MechlabError(f"{m.name}: drive {drive.name!r}: a winding with the constant 0 gives no force.")
        gain = w.constant / w.resistance
        return Servo(drive.on, Hold(value), 0.0, w.constant * gain, force), gain, force / gain
    law = Servo(drive.on, Hold(value), drive.stiffness, drive.damping, force)
    c = drive.control
    if c is not None:
        gain = c.gear * c.gain
        return law, gain, (force + drive.stiffness * value - c.gear * c.push) / gain
    if drive.stiffness:
        return law, drive.stiffness, value + force / drive.stiffness
    gain = drive.damping or 1.0
    return law, gain, force / gain
