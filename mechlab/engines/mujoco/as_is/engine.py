"""Engine `file`: a scene of a model file that is somebody's own, run by MuJoCo as the file is.

The motion is that of `mj_step` on the compiled file, step by step: its timestep, integrator, solver and softness, its contacts and
its actuators at the controls of the start, or under the commands of the scene (`controls`). Laws of the scene act in addition. What
is recorded are the joints of the mechanism that was read from the file.
"""

from __future__ import annotations

from contextlib import AbstractContextManager

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.clock import costed, move_cost, spent_on
from mechlab.engines.mujoco.as_is.contacts import ContactWatch
from mechlab.engines.mujoco.as_is.controls import FileControls
from mechlab.engines.mujoco.as_is.findings import gave_up, health, start_finding
from mechlab.engines.mujoco.as_is.forces import ActuatorForces
from mechlab.engines.mujoco.as_is.model import Start, file_settings, run_model, start
from mechlab.engines.mujoco.as_is.session import FileSession
from mechlab.engines.mujoco.as_is.work import WorkMeter, energy
from mechlab.engines.mujoco.control import controlled
from mechlab.engines.mujoco.control import engine as quiet
from mechlab.engines.mujoco.model_file.coordinates import FileCoordinates
from mechlab.engines.mujoco.model_file.read_rest import may_touch
from mechlab.engines.mujoco.runner import versions
from mechlab.engines.mujoco.step_loop import Start as StartValues
from mechlab.engines.mujoco.stepping import INTEGRATION_STATE, Grid, advance, grid
from mechlab.engines.protocol import Engine
from mechlab.errors import MechlabError
from mechlab.experiment.acting import rounded
from mechlab.experiment.laws.protocol import LawStates, applied_force
from mechlab.experiment.model_file import ModelFile
from mechlab.experiment.observed import Observed
from mechlab.experiment.recording import Cost, Health, Recording, run_channels
from mechlab.experiment.scene import MUJOCO_INTEGRATORS, Scene, Settings
from mechlab.experiment.tree_plant import TreePlant
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

FEWEST_SAMPLES, SAMPLED = 200, 1.0 / 16.0
"""A long run records this share of its steps, so that recording costs less than stepping."""


class FileEngine(Engine):
    """See the module."""

    name = "file"
    fixed_steps = MUJOCO_INTEGRATORS

    versions = staticmethod(versions)

    def settings(self, file: ModelFile) -> Settings:
        """Timestep and integrator of the file."""
        return file_settings(file)

    def run(
        self, mechanism: Mechanism, scene: Scene, settings: Settings | None = None, times: ArrayLike | None = None
    ) -> Recording:
        """See the module. Channels: those of `basic_channels`, NAME_accel, NAME_force of what actuators and laws act on, and
        BODY_contact_x, _y, _z. A run that blows up ends there, and says so. Raises MechlabError for a scene without a file."""
        if scene.file is None:
            raise no_file(mechanism, scene)
        chosen = settings or file_settings(scene.file)
        at = None if times is None else np.asarray(times, dtype=float).tolist()
        return _run(
            scene.file, scene, chosen, grid(scene.duration, chosen.timestep, at, FEWEST_SAMPLES, SAMPLED), metered=True
        )

    def session(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, seen: Observed, substeps: int = 1,
        start: StartValues | None = None, seed: int | None = None,
    ) -> FileSession:  # fmt: skip
        """See `mechlab.engines.mujoco.as_is.session`."""
        if scene.file is None:
            raise no_file(mechanism, scene)

        def run(moved: Scene, how: Settings) -> Recording:
            return self.run(mechanism, moved, how)

        return FileSession(scene.file, scene, settings, run, seen, substeps, start, seed)

    def at_times(self, mechanism: Mechanism, scene: Scene, settings: Settings, times: ArrayLike) -> Recording:
        """A run that is recorded near the times alone, without its energy: for a comparison with another run."""
        if scene.file is None:
            return self.run(mechanism, scene, settings, times)
        at = np.asarray(times, dtype=float).tolist()
        return _run(scene.file, scene, settings, grid(scene.duration, settings.timestep, at, 1, 0.0), metered=False)


def no_file(mechanism: Mechanism, scene: Scene) -> MechlabError:
    """The error for a scene that is not of a file."""
    return MechlabError(
        f"{mechanism.name}, scene {scene.name}: the engine 'file' runs the MJCF file that a mechanism was read from, in the "
        "scene 'as-is'; for this scene take --engine mujoco."
    )


@costed
def _run(file: ModelFile, scene: Scene, settings: Settings, steps: Grid, metered: bool) -> Recording:
    model = run_model(file, settings)
    states = FileCoordinates(file, model)
    controls = FileControls(file, model, scene.controls)
    step = controls.step if controls else None
    with quiet(), spent_on("record"):
        begin = start(model, states, scene)
        data = begin.data
        controls.put(data, 0.0)
        try:
            meter = WorkMeter(model, data, controls)
            seen = _Samples(file, model, data, states, meter, scene, controls)
            with _laws(scene, states, data):
                end = advance(model, data, states, steps, seen.take, meter.step if metered else step)
        except mujoco.FatalError as error:
            raise MechlabError(f"{file.name}: {gave_up(error, data.time)}") from None
    move_cost("record", "integrate", end[1])
    with spent_on("record"):
        return _recording(file, scene, settings, model, begin, seen, end, metered)


def _recording(
    file: ModelFile,
    scene: Scene,
    settings: Settings,
    model: mujoco.MjModel,
    begin: Start,
    seen: _Samples,
    end: tuple,
    metered: bool,
) -> Recording:
    mechanism = file.mechanism
    blow_up, cpu, done = end
    qpos, v = np.array(seen.qpos), seen.states.rates(np.array(seen.qvel))
    q = seen.states.coordinates(qpos)
    channels, units = run_channels(
        mechanism, q, v, seen.states.rates(np.array(seen.qacc)), seen.forces()
    )
    others, other_units = seen.contacts.channels()
    more, more_units = seen.actuators.channels()
    energies = np.array(seen.energies[: None if metered else 1])
    with spent_on("check"):
        findings = health(mechanism, settings, scene.duration, model, begin.data, blow_up, energies, seen.contacts)
        outside = start_finding(qpos[0], model)
    per_step = 4 if settings.integrator == "RK4" else 1
    return Recording(
        mechanism=mechanism, t=np.array(seen.t), q=q, v=v, channels=channels | more | others, units=units | more_units | other_units,
        health=findings + Health(() if outside is None else (outside,)), cost=Cost(cpu, done, per_step * done), settings=settings,
        scene=scene.name, name=mechanism.name, fidelity=scene.fidelity, versions=versions(),
        acts=acts(model, begin, scene),
    )  # fmt: skip


class _Samples:
    """What is recorded of a run. Each sample is evaluated in data of its own, so that sampling does not change the motion."""

    def __init__(
        self,
        file: ModelFile,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        states: FileCoordinates,
        meter: WorkMeter,
        scene: Scene,
        controls: FileControls,
    ) -> None:
        self.controls = controls
        self.model, self.data, self.states, self.meter, self.scene = model, data, states, meter, scene
        self.own = mujoco.MjData(model)
        self.contacts = ContactWatch(file, model)
        self.actuators = ActuatorForces(file, model)
        self.plant = TreePlant(states.mechanism)
        self.t: list[float] = []
        self.qpos: list[Array] = []
        self.qvel: list[Array] = []
        self.qacc: list[Array] = []
        self.energies: list[tuple[float, float, float, float]] = []
        self._loads: list[dict[str, float]] = []
        self._state = np.empty(mujoco.mj_stateSize(model, INTEGRATION_STATE))

    def take(self, t: float) -> bool:
        """Record the present state."""
        model, data, own = self.model, self.data, self.own
        mujoco.mj_getState(model, data, self._state, INTEGRATION_STATE)
        mujoco.mj_setState(model, own, self._state, INTEGRATION_STATE)
        own.time = t
        self.controls.put(own, t)
        if self.scene.laws:
            self._loads.append(_apply(self.scene, self.states, self.plant, own))
        mujoco.mj_forward(model, own)
        if not np.all(np.isfinite(own.qacc)):
            if not self.t:
                raise MechlabError(
                    f"{self.states.mechanism.name}: MuJoCo's accelerations of the file at t = 0 are not finite."
                )
            return False
        self.t.append(t)
        self.qpos.append(own.qpos.copy())
        self.qvel.append(own.qvel.copy())
        self.qacc.append(own.qacc.copy())
        self.energies.append((*energy(model, own), self.meter.done, self.meter.turned))
        self.contacts.take(own)
        self.actuators.take(own)
        return False

    def forces(self) -> dict[str, Array]:
        """Joint or shaft -> (n,) force of the actuators and laws on it."""
        out = self.actuators.on_coordinates()
        for name in dict.fromkeys(n for now in self._loads for n in now):
            out[name] = out.get(name, 0.0) + np.array([now.get(name, 0.0) for now in self._loads])
        return out


def _laws(scene: Scene, states: FileCoordinates, data: mujoco.MjData) -> AbstractContextManager[None]:
    """The context in which the engine steps under the laws of the scene, evaluated at every stage of a step."""
    if not scene.laws:
        return quiet()
    if len(LawStates(scene.laws)):
        raise MechlabError(
            f"{states.mechanism.name}: laws with states of their own (a motor with inductance) do not act on a run of the file; "
            "take --engine mujoco."
        )
    plant = TreePlant(states.mechanism)

    def act() -> None:
        _apply(scene, states, plant, data)

    return controlled(data, act)


def _apply(scene: Scene, states: FileCoordinates, plant: TreePlant, data: mujoco.MjData) -> dict[str, float]:
    plant.set(*states.to_mechanism(data.qpos, data.qvel), data.time)
    force, by_name = applied_force(states.mechanism, scene.laws, data.time, plant)
    data.qfrc_applied[states.dof] = force
    return by_name


def acts(model: mujoco.MjModel, begin: Start, scene: Scene) -> str:
    """One line on what acts in a run of a file."""
    still = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY or not np.any(model.opt.gravity)
    parts = ["the file as it is: no gravity" if still else "the file as it is: gravity"]
    geoms, pairs = may_touch(model)
    touching = len({*geoms, *model.pair_geom1[pairs].tolist(), *model.pair_geom2[pairs].tolist()})
    parts.append(f"contacts of {touching} geoms" if touching else "no contacts")
    if model.neq:
        parts.append(f"{int(np.count_nonzero(begin.data.eq_active))} equalities with the file's softness")
    if model.nu:
        parts += _actuators(model, scene)
    if scene.laws:
        parts.append(f"laws on {', '.join(dict.fromkeys(n for law in scene.laws for n in law.targets()))}")
    return "; ".join([*parts, begin.text])


def _actuators(model: mujoco.MjModel, scene: Scene) -> list[str]:
    """Texts on the actuators that follow commands, and on those that stand at the controls of the start."""
    commanded, rest = rounded(list(scene.controls)), model.nu - len(scene.controls)
    out = [f"commands of {commanded} in the file's units, held over a step"] if commanded else []
    if rest:
        at_keyframe = model.nkey > 0 and np.any(model.key_ctrl[0])
        values = "the controls of the keyframe" if at_keyframe else "0"
        out.append(f"{rest} {'other ' if commanded else ''}actuators at {values}")
    return out


ENGINES = {"file": FileEngine()}
