"""What every engine answers, and the registry in which engines are found by name.

    engine("mujoco").run(mechanism, scene, settings, times)      # a Recording
    engine("pinocchio").state(mechanism, q, v).mass_matrix       # an EngineState
    available("drake")                                           # "", or a sentence that says why not

An engine is imported when it is first asked for. `numpy` is the tree of `mechlab.mechanism` itself: it answers for states and
runs nothing. `pinocchio` and `mujoco` are witnesses as well: they assemble a mechanism and give rates, accelerations and the
motion of frames by their own kinematics. `file` runs a stranger's MJCF as it is; `one_freedom` and `hybrid` only run; the peers
only make traces for charts.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from mechlab.clock import spent_on
from mechlab.errors import EngineMissing, MechlabError, unknown
from mechlab.experiment.laws import Law, Plant
from mechlab.experiment.model_file import ModelFile
from mechlab.experiment.recording import Recording, Trace
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kept import LastKept
from mechlab.mechanism.model import Mechanism

if TYPE_CHECKING:  # what describes a design needs the names of the engines alone
    from mechlab.engines.motions import KeptMotions
    from mechlab.engines.state import EngineState, LoopLoads, MotionForces
    from mechlab.experiment.observed import Observed
    from mechlab.experiment.prices import Price
    from mechlab.experiment.tree_plant import MassShare
    from mechlab.mechanism.newton import Assembly
    from mechlab.mechanism.warm_start import PoseEquations


class StatePlant(Plant, Protocol):
    """A Plant that can be put into a state, and that knows its poses, its closure and its masses."""

    def set(self, q: ArrayLike, v: ArrayLike | None = None, t: float = 0.0) -> StatePlant:
        """Move to coordinates q (nq,), rates v (nv,) (default 0), time t [s]."""
        ...

    def pose(self, body: str) -> tuple[Array, Array]:
        """Rotation (3, 3), body axes to world, and origin (3,) of a body [m]."""
        ...

    def point(self, frame: str) -> Array:
        """(3,) origin of a Frame in the world [m]."""
        ...

    def point_jacobian(self, frame: str) -> Array:
        """(6, nv) of a Frame: velocity of its origin, then angular velocity, world axes."""
        ...

    def closing(self) -> tuple[Array, Array, Array]:
        """Residual, rows and rates as in `EngineState`."""
        ...

    def correction(self, residual: Array) -> Array:
        """(nv,) smallest displacement in the sense of the kinetic energy that takes a residual, as of `closing`, away."""
        ...

    def relation_rows(self) -> Array:
        """(relations, nv) rows of the gear relations, in their order."""
        ...

    def masses(self) -> list[MassShare]:
        """Masses and momenta of what moves, body by body or all together."""
        ...


class Engine:
    """What one engine can do; what it cannot raises MechlabError.

    `constraints` and `friction` are how a `mechlab.lab.methods.Method` treats rows and dry friction.
    """

    name: str = ""
    fixed_steps: tuple[str, ...] = ()
    """Integrators that take the timestep of the settings; the others choose their steps by the tolerance."""

    def missing(self) -> str:
        """What must be installed before it can run, as a sentence; "" when all is there."""
        return ""

    def versions(self) -> dict[str, str]:
        """Package -> version of what computes a run."""
        raise self._refusal("runs no scenes")

    def settings(self, file: ModelFile) -> Settings:
        """The settings that a model file asks for."""
        raise self._refusal("runs no model files")

    def run(
        self, mechanism: Mechanism, scene: Scene, settings: Settings | None = None, times: ArrayLike | None = None
    ) -> Recording:
        """The scene as a Recording, sampled at `times` [s] at least."""
        raise self._refusal("runs no scenes")

    def at_times(self, mechanism: Mechanism, scene: Scene, settings: Settings, times: ArrayLike) -> Recording:
        """The scene as a Recording to compare another one with at the times [s]; it may lack findings and other samples."""
        return self.run(mechanism, scene, settings, times)

    def trace(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int, constraints: str = "", friction: str = ""
    ) -> Trace:  # fmt: skip
        """States at `outputs` + 1 even times, and what the stepping cost. By default from `run`."""
        made = self.run(mechanism, scene, settings, np.linspace(0.0, scene.duration, outputs + 1))
        ends = [f.sentence for f in made.health.findings if f.name == "blow_up"]
        return Trace(made.q, made.v, made.cost.cpu_s, made.cost.steps, ends[0] if ends else "", made.cost.evaluations)

    def stepper(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, between: float, constraints: str = "", friction: str = ""
    ) -> Any:
        """A trace that can be continued (`advance(outputs)`), outputs `between` [s] apart; None where it cannot."""
        return None

    def session(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, seen: Observed, substeps: int = 1,
        start: Any = None, seed: int | None = None,
    ) -> Any:  # fmt: skip
        """A step loop in which the caller commands the drives; see `mechlab.engines.mujoco.session`."""
        raise self._refusal("has no step loop")

    def states(self, mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int) -> Array:
        """(n, nq) coordinates of a run at `outputs` + 1 even times; fewer rows when it ended early."""
        return self.run(mechanism, scene, settings, np.linspace(0.0, scene.duration, outputs + 1)).q

    def refuses(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, constraints: str = "", friction: str = ""
    ) -> str:
        """Why `trace` cannot be asked for, or tells nothing new; "" when it can."""
        return f"{self.name} makes no traces"

    def projects(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> bool:
        """Whether runs by steps are projected onto the constraints after each step, so that they keep the order of the integrator."""
        return False

    def price(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> Price:
        """The price of one evaluation of the equations of motion."""
        raise self._refusal("has no price")

    def plant(self, mechanism: Mechanism) -> StatePlant:
        """The mechanism in its reference pose at rest; drives do not act."""
        raise self._refusal("answers for no single state")

    def state(self, mechanism: Mechanism, q: ArrayLike, v: ArrayLike | None = None) -> EngineState:
        """The EngineState at coordinates q (nq,) and rates v (nv,), default 0."""
        from mechlab.engines.state import EngineState

        m, q = mechanism, np.array(q, dtype=float)
        v = np.zeros(m.nv) if v is None else np.array(v, dtype=float)
        plant = self.placed(m, q, v)
        residual, rows, rates = plant.closing()
        poses = {b.name: (np.array(r), np.array(p)) for b in m.bodies for r, p in [plant.pose(b.name)]}  # the plant will move on
        return EngineState(
            m, self.name, q, v, np.array(plant.mass_matrix()), np.array(plant.bias()), poses,
            {f.name: np.array(plant.point(f.name)) for f in m.frames}, np.array(residual), np.array(rows), np.array(rates),
        )  # fmt: skip

    def placed(self, mechanism: Mechanism, q: Array, v: Array) -> StatePlant:
        """The plant of the mechanism at coordinates q (nq,) and rates v (nv,), for who needs little of an EngineState. It is kept, and
        moves on with the next question."""
        plant = _PLANTS.get(lambda m, plant: plant(m), mechanism, self.plant)
        plant.set(q, v)
        return plant

    def equations(self, mechanism: Mechanism, laws: tuple[Law, ...], h: float) -> Any:
        """The equations of motion under laws as a function of (t, y), dry friction smoothed for steps of h [s]."""
        raise self._refusal("has no equations of motion to integrate")

    def small_motions(self, mechanism: Mechanism, laws: tuple[Law, ...] = ()) -> Any:
        """Forces, rows and masses near a rest, as `mechlab.studies.modes.eigen.Dynamics`."""
        raise self._refusal("answers for no small motions")

    def file_size(self, path: Path) -> tuple[float, int]:
        """Mass [kg] and number of rates of a model file (MJCF, URDF) as the engine itself reads it. Pinocchio drops the mass of
        what is welded to the ground. Raises MechlabError for a file that it refuses."""
        raise self._refusal("reads no model files")

    def accelerations(self, mechanism: Mechanism, q: ArrayLike, v: ArrayLike, force: ArrayLike | None = None) -> Array:
        """(nv,) accelerations under the generalized force (nv,) by the engine's own forward dynamics."""
        raise self._refusal("answers for no single state")

    def motion_forces(
        self, mechanism: Mechanism, q: Array, v: Array, drive: str, acceleration: float, load: Array
    ) -> MotionForces:
        """What the drive (a joint or shaft) needs for its acceleration [rad/s2 or m/s2] at states q (n, nq), v (n, nv) under
        the constant load (nv,), and the reactions. Raises NoSolution where the drive cannot make the motion."""
        raise self._refusal("answers for no reactions")

    def loop_loads(self, mechanism: Mechanism, q: Array, v: Array, force: Array) -> LoopLoads:
        """What the loops carry where they alone balance the generalized forces (n, nv), at states q (n, nq), v (n, nv)."""
        raise self._refusal("answers for no reactions")

    def assemble(
        self, mechanism: Mechanism, given: Mapping[str, Any], start: ArrayLike | None = None, steps: int = 10
    ) -> Assembly:
        """Coordinates that close all loops and have the given joints, shafts, FRAME_x _y _z, FRAME_rotation."""
        raise self._refusal("is no witness")

    def rates(self, mechanism: Mechanism, q: ArrayLike, given: Mapping[str, float]) -> Array:
        """(nv,) rates that keep the loops closed and have the given ones; raises NoSolution when they contradict."""
        raise self._refusal("is no witness")

    def accelerations_of(self, mechanism: Mechanism, q: ArrayLike, v: ArrayLike, given: Mapping[str, float]) -> Array:
        """(nv,) accelerations that keep the loops closed at rates v and have the given ones; raises NoSolution."""
        raise self._refusal("is no witness")

    def pose_equations(self, mechanism: Mechanism, names: tuple[str, ...]) -> PoseEquations:
        """The closing equations with the named quantities, for many solutions in the same thread; see `mechlab.engines.closer`."""
        raise self._refusal("closes no loops")

    def motions(self, mechanism: Mechanism) -> KeptMotions:
        """Rates, accelerations and motions of frames at many poses; kept for the next question about the mechanism."""
        raise self._refusal("is no witness")

    def frame_motion(
        self, mechanism: Mechanism, frame: str, q: ArrayLike, v: ArrayLike | None = None, a: ArrayLike | None = None
    ) -> tuple[Array, Array, Array]:
        """Pose (4, 4), velocity (6,), acceleration (6,) of a Frame: linear at its origin, then angular, world axes."""
        raise self._refusal("is no witness")

    def _refusal(self, what: str) -> MechlabError:
        return MechlabError(f"the engine {self.name} {what}.")


_PLANTS = LastKept()
_PINOCCHIO = "Pinocchio is not installed; `pip install pin` (there is no wheel for Windows: use WSL)."
_ADDRESSES: dict[str, tuple[str, str]] = {
    "numpy": ("tree", ""),
    "pinocchio": ("pinocchio.engine", _PINOCCHIO),
    "mujoco": ("mujoco.engine", "mujoco is not installed (mujoco is missing); pip install mujoco."),
    "file": ("mujoco.as_is.engine", "mujoco is not installed (mujoco is missing); pip install mujoco."),
    "one_freedom": ("own.one_freedom", ""),
    "hybrid": ("own.hybrid", ""),
    "exudyn": ("peers.engine", ""),
    "drake": ("peers.engine", ""),
    "opensim": ("peers.engine", ""),
    "mujoco_warp": ("peers.engine", ""),
    "newton": ("peers.engine", ""),
}
"""Engine -> the module below `mechlab.engines` that lists it in ENGINES, and the sentence where its package is not installed."""
WITNESSES = ("pinocchio", "mujoco")
"""Engines that answer questions about a mechanism by their own kinematics."""
IMPLEMENTATIONS = ("numpy", *WITNESSES)
"""Engines that compute the state of a mechanism, each from a model of its own."""


def engine(name: str) -> Engine:
    """The engine of that name. Raises EngineMissing with what to install, MechlabError that lists the names of all engines."""
    if name not in _ADDRESSES:
        raise unknown("engine", name, _ADDRESSES)
    module, missing = _ADDRESSES[name]
    try:
        there = sys.modules.get(f"mechlab.engines.{module}")
        if there is None:
            with spent_on("imports"):
                there = import_module(f"mechlab.engines.{module}")
        found: Engine = there.ENGINES[name]
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        raise EngineMissing(missing) from None
    return found


def available(name: str) -> str:
    """Why the engine cannot be used here, as a sentence; "" when it can. Raises MechlabError for an unknown name."""
    try:
        return engine(name).missing()
    except EngineMissing as missing:
        return str(missing)
