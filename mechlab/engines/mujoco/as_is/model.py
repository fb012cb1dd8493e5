"""The compiled model of a file, its own settings, and the state in which it starts."""

from __future__ import annotations

import copy

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import given_name
from mechlab.engines.mujoco.model_file.coordinates import FileCoordinates
from mechlab.engines.mujoco.model_file.missing_meshes import load_model
from mechlab.engines.mujoco.model_file.start import start_data
from mechlab.engines.mujoco.model_file.trace import INTEGRATORS, at_timestep, integrator_name
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.model_file import ModelFile
from mechlab.experiment.scene import Scene, Settings
from mechlab.formats.model_text import read_text
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.assembly import close
from mechlab.mechanism.geometry import Array

KEPT = 4
_kept: list[tuple[ModelFile, mujoco.MjModel]] = []
"""The last models, each with the reading of its file that it belongs to."""


def model_of(file: ModelFile) -> mujoco.MjModel:
    """A model of the file for the caller alone. It is compiled once for a reading of the file."""
    for known, model in _kept:
        if known is file:
            return copy.copy(model)
    if file.path is None:
        raise MechlabError(f"{file.name}: a text has no file that the engine 'file' could run.")
    model, _ = load_model(file.path, read_text(file.path))
    _kept.append((file, model))
    del _kept[:-KEPT]
    return copy.copy(model)


def file_settings(file: ModelFile) -> Settings:
    """Timestep and integrator that the file asks for; its softness stands at each of its elements."""
    model = model_of(file)
    return Settings("file", integrator_name(model), float(model.opt.timestep), None, None, preset="file")


def run_model(file: ModelFile, settings: Settings) -> mujoco.MjModel:
    """The model of the file at the timestep and with the integrator of the settings. The engine's automatic restart of a state that
    has blown up is off: such a run ends there."""
    model = at_timestep(model_of(file), settings.timestep)
    model.opt.integrator = INTEGRATORS[settings.integrator]
    return model


@dataclass(frozen=True)
class Start:
    """Where a run starts, in words: "keyframe 'home'"; its data carry controls, activations and mocap poses, too."""

    text: str
    data: mujoco.MjData


def start(model: mujoco.MjModel, states: FileCoordinates, scene: Scene) -> Start:
    """The first keyframe of the file if it has one, or else qpos0, with the initial values of the scene.

    Loops are closed again where a value moves them. Raises NoSolution where they do not close.
    """
    data = start_data(model)
    text = "starts at the file's qpos0"
    if model.nkey:
        text = f"starts at the keyframe {given_name(model, mujoco.mjtObj.mjOBJ_KEY, 0) or '0'}"
    if scene.initial or scene.initial_rates:
        q, v = states.to_mechanism(data.qpos, data.qvel)
        q, v = _moved(states, scene, q), _faster(states, scene, v)
        data.qpos[:], data.qvel[:] = states.to_file(q, v)
        text += f", with {', '.join((*scene.initial, *(f'{n}_rate' for n in scene.initial_rates)))} as given"
    return Start(text, data)


def _moved(states: FileCoordinates, scene: Scene, q: Array) -> Array:
    m = states.mechanism
    if not scene.initial:
        return q
    for name in scene.initial:
        m.row(name)  # raises for a name that does not exist
    joints = {j.name for j in m.joints}
    shafts = [n for n in scene.initial if n not in joints]
    if not (m.is_closed or shafts):
        q = q.copy()
        for name, value in scene.initial.items():
            q[m.q_slice[name]] = value - m.zero(name)
        return q
    found = close(m, q, dict(scene.initial), steps=10)
    if not found.closed:
        raise NoSolution(
            f"{m.name}: the loops of the file do not close with {', '.join(scene.initial)} as given ({found.status.value}). "
            "Give fewer values, or values nearer the start of the file."
        )
    return found.q


def _faster(states: FileCoordinates, scene: Scene, v: Array) -> Array:
    """Rates with those that are given: of joints alone, as the soft loops of a file take any rate."""
    m = states.mechanism
    v = np.array(v)
    for name, value in scene.initial_rates.items():
        if name not in m.v_slice:
            m.row(name)  # raises for a name that does not exist
            raise MechlabError(f"{m.name}: {name}_rate_0: a run of the file takes the rate of a joint, not of a shaft.")
        v[m.v_slice[name]] = value
    return v
