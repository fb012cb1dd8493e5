"""Equations of motion as functions of (t, state): what the integrators call, and the projection onto the constraints. And what
small motions about a rest need: closed poses, forces, constraint rows and mass matrix (`PinSmallMotions`).

The state is y = (q, v, z, work): coordinates (nq,), rates (nv,), states of the laws, work done on the mechanism less
what dampers took [J].
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.dynamics import PinPlant
from mechlab.engines.pinocchio.reactions import channels
from mechlab.engines.state import RATE_LIMIT, BlowUp, Instant
from mechlab.errors import MechlabError
from mechlab.experiment.laws import Law, LawStates, applied_force
from mechlab.experiment.laws.compiled import CompiledLaws
from mechlab.experiment.prices import EQUATIONS, price_of_laws
from mechlab.integrate import count_work
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array, quaternion_product
from mechlab.mechanism.kinematics import integrate
from mechlab.mechanism.length_unit import row_units
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, newton

CLOSED = 1e-13
LOST = 1e-3
FRICTION_WIDTH = 0.1
"""Least width per timestep [rad/s2 or m/s2]: a finer run smooths less."""


Forward = Callable[[Array], tuple[Array, Array, Array]]
"""Force of the laws (nv,) -> that with dry friction (nv,), accelerations (nv,), reactions (rows,)."""


class Equations:
    """The equations of motion of a mechanism under laws, on Pinocchio.

    Dry friction is smoothed: -friction tanh(rate / width), where `width` [rad/s or m/s] is at least FRICTION_WIDTH h and
    wide enough for a step of size h to be stable; `able` [rad/s2 or m/s2] is the acceleration by the friction alone.
    `corrected` is the largest projection so far [m or rad].
    """

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...], h: float, plant: PinPlant | None = None) -> None:
        self.mechanism = mechanism
        self.plant = PinPlant(mechanism) if plant is None else plant
        self.laws = laws
        self.memory = LawStates(laws)
        self.corrected = 0.0
        self._correction = EQUATIONS.of(mechanism)
        self.price = self._correction + price_of_laws(laws)
        self.units = row_units(mechanism, ConstraintSet(mechanism))
        self.applied = CompiledLaws(mechanism, laws)
        self.quaternions = [mechanism.q_slice[j.name] for j in mechanism.joints if j.kind == "spherical"]
        self.turns = [mechanism.v_slice[j.name] for j in mechanism.joints if j.kind == "spherical"]
        columns = self.plant.passive.columns
        self.columns: Array | slice = slice(None) if np.array_equal(columns, range(mechanism.nq)) else columns
        self._nq, self._end = mechanism.nq, mechanism.nq + mechanism.nv
        rows = self.plant.passive.friction.rows
        inverse = np.linalg.pinv(self.plant.mass_matrix()) if len(rows) else np.zeros((0, 0))
        softness = np.einsum("ij,jk,ik->i", rows, inverse, rows) if len(rows) else np.zeros(0)
        self.able = self.plant.passive.friction.sizes * softness
        self.width = h * np.maximum(FRICTION_WIDTH, self.able)

    def start(self, q: Array, v: Array) -> Array:
        """The state (q, v, z, 0) with the states z that the laws start from."""
        return np.concatenate([q, v, self.memory.initial, [0.0]])

    def split(self, y: Array) -> tuple[Array, Array]:
        """q (nq,) and v (nv,) of a state."""
        return y[: self._nq], y[self._nq : self._end]

    def law_states(self, y: Array) -> Array:
        """States of the laws in a state."""
        return y[self._end : -1]

    def channels(
        self, t: Array, q: Array, v: Array, instants: Sequence[Instant]
    ) -> tuple[dict[str, Array], dict[str, str]]:
        """Channels of a run and their units: see `mechlab.engines.pinocchio.reactions.channels`."""
        return channels(self.plant, t, q, v, instants)

    def move(self, t: float, y: Array) -> PinPlant:
        """The plant at a state; raises BlowUp when the state is not finite or too fast."""
        q, v = self.split(y)
        if not y.dot(y) < RATE_LIMIT**2:
            self._refuse_runaway(t, y, v)
        plant = self.plant
        if len(self.memory):
            self.memory.put(plant, self.law_states(y))
        if plant.q.tobytes() != q.tobytes():
            return plant.set(q.copy(), v.copy(), t)
        if plant.v.tobytes() != v.tobytes():
            plant.set_rates(v.copy(), t)
        plant.t = t
        return plant

    def _refuse_runaway(self, t: float, y: Array, v: Array) -> None:
        """Raise BlowUp for a state that is not finite or too fast."""
        if not np.isfinite(y).all():
            raise BlowUp(t, "the state is not finite")
        fastest = int(np.argmax(np.abs(v))) if len(v) else 0
        if len(v) and abs(v[fastest]) > RATE_LIMIT:
            name = self.mechanism.rate_names[fastest]
            raise BlowUp(t, f"the rate of {name} is {v[fastest]:.3g}, beyond {RATE_LIMIT:g}")

    def forward(self, force: Array) -> tuple[Array, Array, Array]:
        """Generalized force (nv,) with dry friction, accelerations (nv,) and reactions (rows,) under the force (nv,) of the laws, at
        the state of the plant."""
        plant = self.plant
        if len(self.width):
            force = force + plant.passive.friction.force(plant.v, self.width)
        return force, *plant.accelerations(force)

    def instant(self, t: float, y: Array, forward: Forward | None = None) -> Instant:
        """Accelerations, reactions and forces at a state; forward: what takes the place of `self.forward`. Errors that laws raise
        surface, and a force that is not finite is a MechlabError. Raises BlowUp where the motion cannot go on."""
        count_work(self.price)
        plant = self.move(t, y)
        try:
            forces, force = self._pushes(t, plant, y)
        except (np.linalg.LinAlgError, OverflowError) as problem:  # of a state that no law was made for
            raise BlowUp(t, str(problem)) from problem
        try:
            force, a, reactions = (forward or self.forward)(force)
        except (MechlabError, np.linalg.LinAlgError, OverflowError, ZeroDivisionError) as problem:
            raise BlowUp(t, str(problem)) from problem
        if not all(map(math.isfinite, a.tolist())):
            for name, f in zip(self.applied.targets, forces.tolist(), strict=True):
                if not math.isfinite(f):  # of a law, not of a state that has run away: `move` has looked
                    raise MechlabError(f"{self.mechanism.name}: the laws give {name!r} the force {f} at t = {t:.6g} s.")
            raise BlowUp(t, "the accelerations are not finite")
        power = float(force @ plant.v) - plant.passive.loss(plant.v)
        return Instant(a, reactions, dict(zip(self.applied.targets, forces.tolist(), strict=True)), power)

    def _pushes(self, t: float, plant: PinPlant, y: Array) -> tuple[Array, Array]:
        """Forces of the laws on their targets, and the generalized force (nv,), at the state of the plant."""
        laws = self.applied
        laws.put(t, plant.q, plant.v)
        if len(self.memory):
            laws.put_states(self.law_states(y))
        return laws.forces(t, plant)

    def slope(self, t: float, y: Array, forward: Forward | None = None) -> Array:
        """dy/dt; forward as in `instant`."""
        now = self.instant(t, y, forward)
        q, v = self.split(y)
        out = np.empty_like(y)
        dq = out[: self._nq]
        dq[self.columns] = v
        for qs, vs in zip(self.quaternions, self.turns, strict=True):
            dq[qs] = 0.5 * quaternion_product(q[qs], np.concatenate([[0.0], v[vs]]))
        out[self._nq : self._end] = now.a
        if len(self.memory):
            out[self._end : -1] = self.applied.state_rates(t, self.plant)
        out[-1] = now.power
        return out

    def project(self, t: float, y: Array) -> Array:
        """The nearest state on the constraints, in the sense of the kinetic energy; quaternions of unit length."""
        y = y.copy()
        q, v = self.split(y)
        for qs in self.quaternions:
            q[qs] /= np.linalg.norm(q[qs])
        plant = self.move(t, y)
        if not len(plant.constraints):
            return y
        count_work(self._correction)
        before = q.copy()
        for _ in range(6):
            residual = plant.residual()
            size = float(np.abs(residual / self.units).max())
            if size < CLOSED:
                break
            if not size < LOST:
                raise BlowUp(t, f"the closure was lost: a loop or gear is open by {size:.3g} after one step")
            plant.set(integrate(self.mechanism, plant.q, plant.correction(residual)), v.copy(), t)
        q[:] = plant.q
        self.corrected = max(self.corrected, float(np.abs(q - before).max()))
        v += plant.correction(plant.jacobian() @ v)
        plant.set_rates(v.copy(), t)
        return y

    def semi_implicit(self, t: float, y: Array, h: float) -> Array:
        """The state after one step of the semi-implicit Euler method: rates first, then coordinates with the new
        rates."""
        now = self.instant(t, y)
        q, v = self.split(y)
        faster = v + h * now.a
        kept = self.memory.after(t, self.plant, self.law_states(y), h)
        return np.concatenate([integrate(self.mechanism, q, h * faster), faster, kept, [y[-1] + h * now.power]])


class PinSmallMotions:
    """A mechanism under laws, held still at time 0; implements `mechlab.studies.modes.eigen.Dynamics` on Pinocchio.

    A pose x is the Mechanism's coordinates (nq,); displacements and rates have its nv entries.
    """

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...] = ()) -> None:
        self.mechanism, self.laws = mechanism, laws
        self.plant = PinPlant(mechanism)
        self.nv = mechanism.nv

    def pose(self, q: ArrayLike) -> Array:
        """(nq,) the pose of coordinates q (nq,)."""
        return np.array(q, dtype=float)

    def coordinates(self, x: Array) -> Array:
        """(nq,) coordinates of a pose."""
        return x

    def rates(self, basis: Array) -> Array:
        """(nv, k) columns in the order of the Mechanism's rates."""
        return basis

    def moved(self, x: Array, dv: Array) -> Array:
        """The pose after the displacement dv (nv,), not closed again."""
        return integrate(self.mechanism, x, dv)

    def closed(self, x: Array) -> Assembly:
        """The nearest pose in which all loops and relations are closed: Newton with the smallest steps."""
        return newton(lambda q: (self.plant.set(q).residual(), self.plant.jacobian()), self.moved, x)

    def rows(self, x: Array) -> Array:
        """(rows, nv) constraint Jacobian."""
        return self.plant.set(x).jacobian()

    def mass(self, x: Array) -> Array:
        """(nv, nv) mass matrix, armatures and shafts included."""
        return self.plant.set(x).mass_matrix()

    def force(self, x: Array, v: Array | None = None) -> Array:
        """(nv,) g of M a + g = J^T reactions: weight, springs, dampers, velocity terms, less the laws."""
        plant = self.plant.set(x, np.zeros(self.nv) if v is None else v)
        return plant.bias() - applied_force(self.mechanism, self.laws, 0.0, plant)[0]
