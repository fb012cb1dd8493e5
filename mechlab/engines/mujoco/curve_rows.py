"""Curves on MuJoCo: their rows written into the engine's own arrays at every evaluation, because its polynomials have degree 4.

The engine makes the rows of all equalities (position), their rates (velocity), then calls the control callback, then solves. In the
callback the state is that of the stage, so that the row of a curve is made anew there from f, f' and f'':

    efc_pos = q_b - f(q_a)     efc_J = e_b - f' e_a     efc_vel = J v     efc_aref = -B efc_vel - K d efc_pos + f'' v_a^2

The last term is -dJ/dt v, which the engine has in the rows of connects and welds, not in those of joints: accelerations and forces of
curves are right at every stage, not only after the soft row has settled. Nothing lags, at no stage of RK4. The equality of the model is
kept at the quadratic about the state, for whoever evaluates the model without the callback (`MujocoState`, `Closure`), and for the
softness of the row, which goes with its slope (diagexact).

Islands are switched off in such a model: the engine copies the rows of an island before the callback.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import controlled, engine
from mechlab.errors import MechlabError
from mechlab.mechanism.curve import Curve
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

NO_ROLLOUT = "curves are followed in a callback at every stage, which runs of many motions inside the engine do not have"


class CurveRows:
    """The rows of all curves of a mechanism in one model of MuJoCo; see the module."""

    def __init__(self, mechanism: Mechanism, model: mujoco.MjModel) -> None:
        self.model = model
        self._items: list[tuple[int, int, int, int, int, float, float, Curve]] = []
        for relation in mechanism.curves:
            k = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_EQUALITY, relation.name)
            if k < 0:
                raise MechlabError(f"the MuJoCo model has no equality {relation.name!r}.")
            one, two = int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
            q = int(model.jnt_qposadr[one]), int(model.jnt_qposadr[two])
            v = int(model.jnt_dofadr[one]), int(model.jnt_dofadr[two])
            zeros = mechanism.zero(relation.output), mechanism.zero(relation.input)
            self._items.append((k, *q, *v, *zeros, relation.curve))
        if self._items:
            model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND

    def __bool__(self) -> bool:
        return bool(self._items)

    def place(self, qpos: Array) -> None:
        """Put the quadratics of all curves about a pose into the model: its rows are right at that pose."""
        for k, _, a, _, _, zero_b, zero_a, curve in self._items:
            x = float(qpos[a])
            self._quadratic(k, x, curve.at(zero_a + x), zero_b)

    def _quadratic(self, k: int, x: float, law: tuple[float, float, float], zero: float) -> None:
        f, slope, bend = law
        self.model.eq_data[k, :5] = (f - zero) - slope * x + 0.5 * bend * x * x, slope - bend * x, 0.5 * bend, 0.0, 0.0

    def put(self, data: mujoco.MjData) -> None:
        """Make the rows of all curves at the state of the data, which is evaluated in position and velocity."""
        for k, b, a, row_b, row_a, zero_b, zero_a, curve in self._items:
            x, rate = float(data.qpos[a]), float(data.qvel[row_a])
            law = curve.at(zero_a + x)
            self._quadratic(k, x, law, zero_b)
            i = self._row(data, k)
            gap = zero_b + float(data.qpos[b]) - law[0]
            speed = float(data.qvel[row_b]) - law[1] * rate
            start = i * self.model.nv
            row = data.efc_J[start : start + self.model.nv]
            row[:] = 0.0
            row[row_b], row[row_a] = 1.0, -law[1]
            stiffness, damping, impedance, _ = data.efc_KBIP[i]
            data.efc_pos[i], data.efc_vel[i] = gap, speed
            data.efc_aref[i] = law[2] * rate * rate - damping * speed - stiffness * impedance * gap

    def _row(self, data: mujoco.MjData, equality: int) -> int:
        """Where the row of an equality stands; the engine drops rows of others that no motion can violate."""
        found = np.flatnonzero(data.efc_id[: data.ne] == equality)
        if len(found) != 1:
            name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_EQUALITY, equality)
            raise MechlabError(f"the MuJoCo model: the curve {name!r} has no row; is its equality switched off?")
        return int(found[0])

    def before(self, function: Callable[[], None] | None, data: mujoco.MjData) -> Callable[[], None]:
        """A control function that makes the rows, then calls another one, whose laws may read them."""

        def act() -> None:
            self.put(data)
            if function is not None:
                function()

        return act

    def acting(self, data: mujoco.MjData, function: Callable[[], None] | None = None) -> AbstractContextManager[None]:
        """Within the block the engine calls the function, if any, and makes the rows of the curves, if any."""
        if self._items:
            return controlled(data, self.before(function, data))
        return engine() if function is None else controlled(data, function)


@contextmanager
def evaluating(curves: CurveRows, data: mujoco.MjData) -> Iterator[None]:
    """Within the block mj_forward of the data knows the curves."""
    curves.place(data.qpos)
    with curves.acting(data):
        yield
