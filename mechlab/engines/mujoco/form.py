"""A mechanism as MuJoCo's users take it: MjModel and MjData, ready to step, and states by name.

model, data = form = ml.load("fourbar").to_mujoco()
data.qpos[:], data.qvel[:] = form.engine_state(values, rates)      # names and physical values -> qpos, qvel
values, rates = form.named_state(data.qpos, data.qvel)             # and back
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.mujoco.model import MujocoMap, to_mujoco
from mechlab.experiment.scene import Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.named_state import Named, named_rates, named_values, numbers_of, state_of


class MujocoForm:
    """It unpacks as (model, data): the compiled MJCF that `save` writes, in the reference pose, evaluated (mj_forward).

    Both are the caller's own. data.ctrl: one control for each drive, 0 where it holds its target: the change of the target of a
    servo, the force of a motor, the voltage of a winding. Equalities close loops and gears; they and their bodies keep our names.
    Some kinds of loops need bodies of the engine's own (connectors): `engine_state` places them too. `map`: where names stand.
    """

    def __init__(self, mechanism: Mechanism, settings: Settings | None = None) -> None:
        self.mechanism = mechanism
        self.model: mujoco.MjModel
        self.data: mujoco.MjData
        self.model, self.data = to_mujoco(mechanism, settings)
        self.map = MujocoMap(mechanism, self.model)

    def __iter__(self) -> Iterator[Any]:
        return iter((self.model, self.data))

    def __len__(self) -> int:
        return 2

    def __getitem__(self, k: int) -> Any:
        return (self.model, self.data)[k]

    def engine_state(self, values: Named | ArrayLike, rates: Named | ArrayLike | None = None) -> tuple[Array, Array]:
        """MuJoCo's qpos (nq,) and qvel (nv,) for physical values and rates of all joints by name, or for the coordinates and rates of the
        Mechanism as arrays; rates default to 0. Connectors follow. Raises MechlabError that names what is missing."""
        q, v = state_of(self.mechanism, values, rates)
        qpos = self.map.engine_coordinates(q)
        return qpos, self.map.engine_rates(qpos, v)

    def named_state(
        self, qpos: ArrayLike, qvel: ArrayLike | None = None
    ) -> tuple[dict[str, float | Array], dict[str, float | Array]]:
        """Physical values and rates of all joints and shafts by name for MuJoCo's qpos and qvel: the inverse of `engine_state`."""
        m, model = self.mechanism, self.model
        q = self.map.coordinates(numbers_of(m, qpos, model.nq, "MuJoCo's qpos"))
        v = np.zeros(m.nv) if qvel is None else self.map.rates(numbers_of(m, qvel, model.nv, "MuJoCo's qvel"))
        return named_values(m, q), named_rates(m, v)
