"""Motion of epicyclic trains: the scene of constant torques with its closed form, all planets along a run, and questions for
speeds by the Willis equation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.laws import Constant
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.kit.checks import closed_form_recording
from mechlab.kit.epicyclic_build import fidelity_texts
from mechlab.kit.questions import for_engines
from mechlab.kit.witness import engine_answer
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

Build = Callable[[Any, str], Mechanism]


@dataclass(frozen=True)
class ConstantTorques:
    """The motion of a train that starts from rest under constant torques: its scene of 0.5 s and its closed form.

    members: what the torques act on, in words. torques: joint or shaft -> the parameter that is its torque [N m].
    accelerations: parameters -> joint of the minimal model -> acceleration [rad/s2].
    """

    build: Build
    members: str
    torques: Mapping[str, str]
    accelerations: Callable[[Any], Mapping[str, float]]

    def scene(self, p: Any, fidelity: str) -> Scene:
        """The scene in a fidelity."""
        laws = tuple(Constant(name, getattr(p, torque)) for name, torque in self.torques.items())
        tolerance = 1e-6 if fidelity == "minimal" else 1e-4  # with a row for each mesh, MuJoCo's soft rows slip
        return Scene("constant-torques", fidelity, 0.5, laws, needs=("poses", "drive_forces"), tolerance=tolerance)

    def reference(self, p: Any, scene: Scene) -> Recording:
        """The closed form in the minimal model: q = a t^2 / 2."""
        m, by_joint = self.build(p, "minimal"), self.accelerations(p)
        a = np.array([by_joint[j.name] for j in m.joints])
        t = np.linspace(0.0, scene.duration, 251)
        q, v = 0.5 * t[:, None] ** 2 * a, t[:, None] * a
        return closed_form_recording(m, scene, t, q, v)

    def entry(self, minimal: str, ray: str = "planet", **more: Any) -> Entry:
        """The Entry of the train. minimal, ray: as of `fidelity_texts`; more: what else an `Entry` takes."""
        text = f"constant torques on {self.members} from rest"
        return Entry(
            build=self.build,
            fidelities=fidelity_texts(minimal, ray),
            default_fidelity="minimal",
            scenes={"constant-torques": SceneRecipe(self.scene, "minimal", text)},
            default_scene="constant-torques",
            reference=self.reference,
            **more,
        )


def expand_by(
    build: Build, values: Callable[[Any, Recording], Mapping[str, Array]]
) -> Callable[[Any, Recording], tuple[Mechanism, Array]]:
    """All planets along a recording of any fidelity; values(p, recording): joint of the full train -> angle (n,)."""

    def expand(p: Any, recording: Recording) -> tuple[Mechanism, Array]:
        full = build(p, "full")
        if recording.fidelity == "full":
            return full, recording.q
        angles = values(p, recording)
        return full, np.column_stack([angles[j.name] for j in full.joints])

    return expand


def speed_questions(
    given: Iterable[tuple[str, ...]],
    members: Sequence[str],
    planets: Mapping[str, str],
    closed_form: Callable[[Any, Mapping[str, Any]], Mapping[str, Any]],
    model: Callable[[Any], Mechanism],
) -> tuple[Question, ...]:
    """A question for the absolute speeds of all members from each tuple of `given` ones, by three witnesses.

    members: their keys, all in rad/s. planets: key of a planet -> its joint, whose rate is relative to the carrier. closed_form:
    parameters and given speeds -> all speeds. model: the Mechanism whose constraint rows the engines ask.
    """

    def analytic(p: Any, known: Mapping[str, Any]) -> Answer:
        return Answer({k: v for k, v in closed_form(p, known).items() if k not in known})

    def by_engine(engine: str, p: Any, known: Mapping[str, Any]) -> Answer:
        central = [k for k in members if k not in planets]
        return engine_speeds(engine, model(p), known, central, planets)

    witnesses = {"analytic": analytic} | for_engines(by_engine)
    units, text = dict.fromkeys(members, "rad/s"), "absolute speeds of all members"
    return tuple(
        Question(f"speeds from {' and '.join(keys)}", keys, tuple(k for k in members if k not in keys), witnesses,
                 text=text, units=units)
        for keys in given
    )  # fmt: skip


def engine_speeds(
    engine: str, m: Mechanism, given: Mapping[str, Any], members: Sequence[str], planets: Mapping[str, str]
) -> Answer:
    """Absolute speeds [rad/s] from the constraint rows of a model, by one engine.

    planets: key of the answer -> joint of the planet. Its rate is relative to the carrier, whose rate is added.
    """
    joints = [f"{name}_rate" for name in planets.values()]
    found = engine_answer(engine, m, {k: float(x) for k, x in given.items()}, [*members, *joints])
    if found.cannot:
        return found
    rates = dict(found.values)
    for key, joint in planets.items():
        rates[key] = rates.pop(f"{joint}_rate") + rates["carrier_rate"]
    return Answer({k: x for k, x in rates.items() if k not in given}, found.status, found.notes)
