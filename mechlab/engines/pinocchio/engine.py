"""Engine `pinocchio`: rigid constraints, projected after every step; a witness by its own kinematics.

What runs scenes is imported by the first run: a witness does without.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.clock import spent_on
from mechlab.engines.pinocchio.closer import kept_closer
from mechlab.engines.pinocchio.dynamics import PinPlant
from mechlab.engines.pinocchio.given_rates import accelerations_of, kept_motions, rates
from mechlab.engines.pinocchio.inverse import Solved, assemble
from mechlab.engines.pinocchio.kinematics import frame_motion
from mechlab.engines.pinocchio.model import file_size
from mechlab.engines.pinocchio.reactions import loop_loads, motion_forces
from mechlab.engines.protocol import Engine
from mechlab.experiment.acting import is_rough, why_no_smooth_tree
from mechlab.experiment.laws import Law
from mechlab.experiment.prices import CONSTRAINED, EQUATIONS, Price
from mechlab.experiment.recording import Recording, Trace
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

if TYPE_CHECKING:
    from mechlab.engines.pinocchio.equations import Equations, PinSmallMotions
    from mechlab.engines.pinocchio.trace import Steps


class Pinocchio(Engine):
    """See the module. Traces for charts are made by Pinocchio's own constrained dynamics where that `fits` the mechanism."""

    name = "pinocchio"
    fixed_steps = ("RK4", "semi_implicit_Euler")

    plant = staticmethod(PinPlant)
    file_size = staticmethod(file_size)
    motion_forces = staticmethod(motion_forces)
    loop_loads = staticmethod(loop_loads)
    rates = staticmethod(rates)
    accelerations_of = staticmethod(accelerations_of)
    frame_motion = staticmethod(frame_motion)
    pose_equations = staticmethod(kept_closer)
    motions = staticmethod(kept_motions)

    def versions(self) -> dict[str, str]:
        """See `mechlab.engines.pinocchio.runner.versions`."""
        from mechlab.engines.pinocchio.runner import versions

        return versions()

    def run(
        self, mechanism: Mechanism, scene: Scene, settings: Settings | None = None, times: ArrayLike | None = None
    ) -> Recording:
        """See `mechlab.engines.pinocchio.runner.run`."""
        with spent_on("imports"):
            from mechlab.engines.pinocchio.runner import run
        return run(mechanism, scene, settings, times)

    def equations(self, mechanism: Mechanism, laws: tuple[Law, ...], h: float) -> Equations:
        """See `mechlab.engines.pinocchio.equations.Equations`."""
        with spent_on("imports"):
            from mechlab.engines.pinocchio.equations import Equations
        return Equations(mechanism, laws, h)

    def small_motions(self, mechanism: Mechanism, laws: tuple[Law, ...] = ()) -> PinSmallMotions:
        """See `mechlab.engines.pinocchio.equations.PinSmallMotions`."""
        from mechlab.engines.pinocchio.equations import PinSmallMotions

        return PinSmallMotions(mechanism, laws)

    def trace(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int, constraints: str = "", friction: str = ""
    ) -> Trace:  # fmt: skip
        """See `mechlab.engines.pinocchio.trace`; constraints: a key of GAINS; friction: "sign", "tanh", or "" without any."""
        with spent_on("imports"):
            from mechlab.engines.pinocchio.friction_trace import trace_friction
            from mechlab.engines.pinocchio.trace import GAINS, Stabilisation, trace
        if friction:
            return trace_friction(mechanism, scene, settings, outputs, friction)
        soft = settings.integrator == "LSODA" or constraints not in GAINS
        return trace(mechanism, scene, settings, outputs, Stabilisation(*GAINS["soft" if soft else constraints]))

    def stepper(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, between: float, constraints: str = "", friction: str = ""
    ) -> Steps | None:
        """See `mechlab.engines.pinocchio.trace.Steps`."""
        with spent_on("imports"):
            from mechlab.engines.pinocchio.trace import GAINS, Stabilisation, Steps, fits
        if friction or settings.integrator in ("DOP853", "LSODA") or not fits(mechanism, scene.laws):
            return None
        return Steps(mechanism, scene, settings, between, Stabilisation(*GAINS[constraints if constraints in GAINS else "soft"]))

    def refuses(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, constraints: str = "", friction: str = ""
    ) -> str:
        """Refuses LSODA for all but smooth trees, and dry friction for a method that does not say how it treats it."""
        if settings.integrator == "LSODA":
            return why_no_smooth_tree(mechanism, scene.laws)
        if is_rough(mechanism) != bool(friction):
            return "no dry friction" if friction else "dry friction: see the methods that say how they take it"
        if constraints == "stiff" and settings.integrator == "RK4":
            with spent_on("imports"):
                from mechlab.engines.pinocchio.trace import fits
            return "" if mechanism.loops and fits(mechanism, scene.laws) else "no stabilization to choose"
        return ""

    def projects(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> bool:
        """All that Pinocchio's own constrained dynamics, whose rows are stabilized, does not fit."""
        with spent_on("imports"):
            from mechlab.engines.pinocchio.trace import fits
        return not fits(mechanism, laws)

    def price(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> Price:
        """The price of Pinocchio's constrained dynamics where it fits, else of the factored equations."""
        with spent_on("imports"):
            from mechlab.engines.pinocchio.trace import fits
        return CONSTRAINED if fits(mechanism, laws) else EQUATIONS

    def accelerations(self, mechanism: Mechanism, q: ArrayLike, v: ArrayLike, force: ArrayLike | None = None) -> Array:
        """(nv,) by the factored equations; of a tree without shafts by the articulated-body algorithm (pin.aba). (n, nv) of n states
        q (n, nq), v (n, nv) under forces (n, nv)."""
        plant = PinPlant(mechanism)
        q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
        applied = np.zeros(v.shape) if force is None else np.asarray(force, dtype=float)
        if q.ndim == 1:
            return _accelerations(plant, q, v, applied)
        return np.array([_accelerations(plant, *state) for state in zip(q, v, applied, strict=True)])

    def assemble(
        self, mechanism: Mechanism, given: Mapping[str, Any], start: ArrayLike | None = None, steps: int = 10
    ) -> Solved:
        """See `mechlab.engines.pinocchio.inverse.assemble`."""
        return assemble(mechanism, given, start=start, steps=steps)


def _accelerations(plant: PinPlant, q: Array, v: Array, applied: Array) -> Array:
    plant.set(q, v)
    if len(plant.constraints) or plant.passive.has_shaft_inertia:
        return plant.accelerations(applied)[0]
    tau = applied - plant.passive.force(plant.v)
    return plant.kin.work.forward(plant.kin.q_pin, plant.v, tau).copy()


ENGINES = {"pinocchio": Pinocchio()}
