"""Engine `mujoco`: soft constraint rows; a witness by Newton's method on its own kinematics and constraint Jacobian.

What runs scenes is imported by the first run: a witness does without.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mechlab.clock import spent_on
from mechlab.engines.mujoco.curve_rows import evaluating
from mechlab.engines.mujoco.model import file_size
from mechlab.engines.mujoco.plant import MujocoSmallMotions, StateOfMujoco
from mechlab.engines.mujoco.reactions import Reactions, motion_forces
from mechlab.engines.mujoco.solve_newton import (
    accelerations_of,
    assemble,
    frame_motion,
    kept_closer,
    kept_motions,
    rates,
)
from mechlab.engines.protocol import Engine
from mechlab.experiment.acting import is_rough, why_no_smooth_tree
from mechlab.experiment.laws import Law
from mechlab.experiment.prices import MUJOCO, Price
from mechlab.experiment.recording import Recording, Trace
from mechlab.experiment.scene import MUJOCO_INTEGRATORS, Scene, Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

if TYPE_CHECKING:
    from mechlab.engines.mujoco.session import Session
    from mechlab.engines.mujoco.step_loop import Start
    from mechlab.engines.mujoco.trace import Steps
    from mechlab.experiment.observed import Observed


class Mujoco(Engine):
    """See the module."""

    name = "mujoco"
    fixed_steps = MUJOCO_INTEGRATORS

    plant = staticmethod(StateOfMujoco)
    small_motions = staticmethod(MujocoSmallMotions)
    file_size = staticmethod(file_size)
    motion_forces = staticmethod(motion_forces)
    assemble = staticmethod(assemble)
    rates = staticmethod(rates)
    accelerations_of = staticmethod(accelerations_of)
    frame_motion = staticmethod(frame_motion)
    pose_equations = staticmethod(kept_closer)
    motions = staticmethod(kept_motions)

    def versions(self) -> dict[str, str]:
        """See `mechlab.engines.mujoco.runner.versions`."""
        from mechlab.engines.mujoco.runner import versions

        return versions()

    def run(
        self, mechanism: Mechanism, scene: Scene, settings: Settings | None = None, times: ArrayLike | None = None
    ) -> Recording:
        """See `mechlab.engines.mujoco.runner.run`."""
        with spent_on("imports"):
            from mechlab.engines.mujoco.runner import run
        return run(mechanism, scene, settings, None if times is None else np.asarray(times, dtype=float).tolist())

    def at_times(self, mechanism: Mechanism, scene: Scene, settings: Settings, times: ArrayLike) -> Recording:
        """See `mechlab.engines.mujoco.runner.run_at`."""
        with spent_on("imports"):
            from mechlab.engines.mujoco.runner import run_at
        return run_at(mechanism, scene, settings, np.asarray(times, dtype=float).tolist())

    def trace(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int, constraints: str = "", friction: str = ""
    ) -> Trace:  # fmt: skip
        """See `mechlab.engines.mujoco.trace`; constraints "extrapolated": by two timesteps (Richardson)."""
        with spent_on("imports"):
            from mechlab.engines.mujoco.trace import adaptive, extrapolated, trace
        if settings.integrator == "LSODA":
            return adaptive(mechanism, scene, settings, outputs)
        if constraints == "extrapolated":
            return extrapolated(mechanism, scene, settings, outputs)
        return trace(mechanism, scene, settings, outputs)

    def stepper(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, between: float, constraints: str = "", friction: str = ""
    ) -> Steps:
        """See `mechlab.engines.mujoco.trace.Steps`."""
        with spent_on("imports"):
            from mechlab.engines.mujoco.trace import Steps
        return Steps(mechanism, scene, settings, between)

    def session(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, seen: Observed, substeps: int = 1,
        start: Start | None = None, seed: int | None = None,
    ) -> Session:  # fmt: skip
        """See `mechlab.engines.mujoco.session`."""
        with spent_on("imports"):
            from mechlab.engines.mujoco.session import Session
        return Session(mechanism, scene, settings, seen, substeps, start, seed)

    def states(self, mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int) -> Array:
        """(n, nq) coordinates at `outputs` + 1 even times: the steps of `run`, without what it records."""
        with spent_on("imports"):
            from mechlab.engines.mujoco.trace import trace
        return trace(mechanism, scene, settings, outputs).q

    def refuses(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, constraints: str = "", friction: str = ""
    ) -> str:
        """Refuses LSODA for all but smooth trees, and hard rows where there are no loops, gears or dry friction."""
        if settings.integrator == "LSODA":
            return why_no_smooth_tree(mechanism, scene.laws)
        if constraints == "hard" and not (mechanism.is_closed or is_rough(mechanism)):
            return "nothing to harden: it has no loops, no gears, no dry friction"
        return ""

    def price(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> Price:
        """The price of one stage of mj_step."""
        return MUJOCO

    def accelerations(self, mechanism: Mechanism, q: ArrayLike, v: ArrayLike, force: ArrayLike | None = None) -> Array:
        """qacc of mj_forward, with rigid rows in place of the engine's soft ones (`Reactions`), and the model's dry friction."""
        plant = StateOfMujoco(mechanism)
        if force is not None:
            plant.data.qfrc_applied[plant.map.dof] = np.asarray(force, dtype=float)
        found, data = Reactions(plant.map, slips=False, alone=True), plant.set(q, v).data
        with evaluating(plant.map.curves, data):
            found.keep(data)
        return found.accelerations()[0]


ENGINES = {"mujoco": Mujoco()}
