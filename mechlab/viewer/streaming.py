"""A simulation on the live page while it runs, and again for every change of its parameters.

A run is watched by a law without force (`Watch`), which every engine calls with its state. `stream` runs a scene in a
thread and sends these states to the page; `Rebuilder` makes a new design of the parameters that a browser sends, and
streams that.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.laws import Plant
from mechlab.experiment.parameters import describe
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene
from mechlab.formats.mechanism_json import from_json
from mechlab.lab.design import Design
from mechlab.lab.design import design as made_of
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lab.own_mechanism import entry_of
from mechlab.lab.run import run_scene
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.values import parse_value
from mechlab.viewer.from_recording import mechanism_story, placed
from mechlab.viewer.live import Control, Reply, Server
from mechlab.viewer.story import Story

PICTURES = 25.0
"""Largest number of pictures sent in a second [1/s]."""


@dataclass
class Pace:
    """began: wall-clock time [s] of the start; shown, latest: time of the run [s] at the last picture and call."""

    began: float = field(default_factory=time.monotonic)
    shown: float = -1.0
    latest: float = -1.0


@dataclass(frozen=True, eq=False)
class Watch:
    """A law that acts on nothing: `see(t, plant)` is called up to PICTURES times a second of the run, and the run is held
    back so that it takes no less than its own time divided by `speed`. `stop()` true ends it: NobodyWatches is raised."""

    see: Callable[[float, Any], None]
    speed: float = 1.0
    stop: Callable[[], bool] = lambda: False
    pace: Pace = field(default_factory=Pace)
    kind: ClassVar[str] = "watch"

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """No force; shows the state, and waits."""
        pace = self.pace
        if t <= pace.latest:
            return {}
        pace.latest = t
        if t - pace.shown >= self.speed / PICTURES:
            if self.stop():
                raise NobodyWatches
            pace.shown = t
            self.see(t, plant)
            ahead = t / self.speed - (time.monotonic() - pace.began)
            if ahead > 0:
                time.sleep(min(ahead, 0.5))
        return {}

    def targets(self) -> tuple[str, ...]:
        """Acts on nothing."""
        return ()


def state_of(plant: Any) -> tuple[Array, Array]:
    """Coordinates (nq,) and rates (nv,) of a plant of either engine."""
    if hasattr(plant, "map"):
        return plant.map.coordinates(plant.data.qpos), plant.map.rates(plant.data.qvel)
    return np.array(plant.q), np.array(plant.v)


def glimpse(plant: Any, t: float, fidelity: str) -> Recording:
    """A Recording of this instant alone."""
    q, v = (x[None] for x in state_of(plant))
    channels, units = basic_channels(plant.mechanism, q, v)
    return Recording(
        plant.mechanism, np.array([t]), q, v, channels, units, name=plant.mechanism.name, fidelity=fidelity
    )


def watched(entry: Entry, watch: Watch) -> Entry:
    """The same entry, with the watch among the laws of every scene."""

    def with_watch(recipe: SceneRecipe) -> SceneRecipe:
        def make(p: Any, fidelity: str) -> Scene:
            scene = recipe.make(p, fidelity)
            return replace(scene, laws=(*scene.laws, watch))

        return replace(recipe, make=make)

    return replace(entry, scenes={name: with_watch(recipe) for name, recipe in entry.scenes.items()})


class NobodyWatches(Exception):
    """Raised to end a run that nobody watches any more."""


def stream(
    server: Server,
    design: Design,
    final: Callable[[Recording], Story],
    scene: str | None = None,
    speed: float = 1.0,
    stop: Callable[[], bool] = lambda: False,
) -> threading.Thread:
    """Runs a scene of the design in a thread, not faster than `speed` times its own time, and shows its state in every
    browser; when it has ended, the page of the recording replaces it. An error is shown on the page. `stop()` true: the
    run is no longer wanted and ends."""
    played = design.for_scene(scene)
    chosen = scene or design.scene_for()
    fidelity = design.entry.scenes[chosen].fidelity

    def over() -> bool:
        return server.closed or stop()

    def see(t: float, plant: Any) -> None:
        now = glimpse(plant, t, fidelity)
        mechanism, q = now.mechanism, now.q
        if played.entry.expand is not None:
            mechanism, q = played.entry.expand(played.parameters, now)
        names, poses, _ = placed(mechanism, q)
        if names != server.story.bodies:
            server.show(mechanism_story(mechanism, design.entry.title))
            return
        own = server.story.model
        server.update(poses[0], q[0] if own is not None and own.nq == mechanism.nq else None)

    def work() -> None:
        watch = Watch(see, speed, over)
        try:
            recording = run_scene(replace(design, entry=watched(design.entry, watch)), scene)
            if not over():
                page = final(recording)
                if not over():
                    server.show(page)
        except NobodyWatches:
            return
        except Exception as error:  # of any engine, law or page: the browser says so, the server goes on
            if not over():
                ended = f"the simulation ended: {sentence_of(error)}"
                server.show(replace(server.story, health=(*server.story.health, ("error", ended))))

    thread = threading.Thread(target=work, name="mechlab-stream", daemon=True)
    thread.start()
    return thread


Wish = dict[str, str] | str
"""What a browser asks for: parameters {key: text}, or the JSON of a model."""
PATIENCE = 20.0
"""How long a run that is no longer wanted may take to end [s]."""


class Rebuilder:
    """The design that a live page shows, its running simulation, and the thread that replaces both when a browser sends
    parameters. `still` makes the page of a design, `final` that of its finished recording.

    The latest wish wins: what a browser sends while a design is built becomes its one next wish, and a design that is
    wanted otherwise by then is not shown. Wishes of several browsers are built together; where that fails, one after
    another, so that a bad value takes none of another browser with it.
    """

    def __init__(
        self, server: Server, first: Design, still: Callable[[Design], Story], final: Callable[[Recording], Story]
    ) -> None:
        self.server, self.design, self.still, self.final = server, first, still, final
        self.built = 0
        """How many designs were made for wishes."""
        self._wishes: dict[Reply, Wish] = {}
        self._changed = threading.Condition()
        self._stop = threading.Event()
        server.show(server.story, controls(first))
        self._run = stream(server, first, final, stop=self._stop.is_set)
        server.on_values, server.on_model = self._take, self._take_model
        self._thread = threading.Thread(target=self._work, name="mechlab-rebuild", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Closes the server, and waits until nothing is built or simulated any more."""
        self.server.close()
        self._stop.set()
        self._thread.join(PATIENCE)
        self._run.join(PATIENCE)

    def _take(self, values: Mapping[str, str], reply: Reply) -> None:
        with self._changed:
            before = self._wishes.pop(reply, {})
            self._wishes[reply] = dict(values) if isinstance(before, str) else before | dict(values)
            self._changed.notify()

    def _take_model(self, text: str, reply: Reply) -> None:
        with self._changed:
            self._wishes[reply] = text
            self._changed.notify()

    def _work(self) -> None:
        while not self.server.closed:
            with self._changed:
                if not self._wishes:
                    self._changed.wait(0.2)
                wishes, self._wishes = self._wishes, {}
            if wishes and not self._attempt(wishes):
                for reply, wish in wishes.items():
                    self._attempt({reply: wish})

    def _attempt(self, wishes: Mapping[Reply, Wish]) -> bool:
        """Builds wishes together, and answers; False, without an answer, where those of several browsers fail."""
        try:
            self._rebuild(wishes)
        except Exception as error:  # whatever fails, the page goes on and says so
            if len(wishes) > 1:
                return False
            for reply in wishes:
                reply(sentence_of(error))
        return True

    def _overtaken(self, wishes: Mapping[Reply, Wish]) -> bool:
        """Whether every browser has sent another model, or all of its parameters, anew."""

        def again(wish: Wish, later: Wish) -> bool:
            return isinstance(later, str) or (not isinstance(wish, str) and wish.keys() <= later.keys())

        with self._changed:
            return all(again(wish, self._wishes.get(reply, {})) for reply, wish in wishes.items())

    def _made(self, wishes: Mapping[Reply, Wish]) -> Design:
        """The design that is asked for: a model as it is, else the present one with other parameters."""
        models = [wish for wish in wishes.values() if isinstance(wish, str)]
        if models and len(wishes) > 1:
            raise MechlabError("a model and other wishes are built one after another.")
        if models:
            return made_of(entry_of(from_json(models[0])), {})
        asked = {key: parse_value(key, text) for wish in wishes.values() if not isinstance(wish, str) for key, text in wish.items()}
        return made_of(self.design.entry, dict(self.design.given) | asked)

    def _rebuild(self, wishes: Mapping[Reply, Wish]) -> None:
        """Raises for values that make no mechanism; then the old one stays and runs on."""
        changed = self._made(wishes)
        self.built += 1
        story = self.still(changed)
        chosen_scene(changed)
        if self._overtaken(wishes):
            return
        self._stop.set()
        self._run.join(PATIENCE)
        self._stop = threading.Event()
        self.design = changed
        for reply in wishes:
            reply(None)
        self.server.show(story, controls(changed))
        self._run = stream(self.server, changed, self.final, stop=self._stop.is_set)


def sentence_of(error: Exception) -> str:
    """What a browser is told of an error: our own sentence, or that it is one of ours; never a traceback."""
    if isinstance(error, MechlabError):
        return str(error)
    first = (str(error).strip().splitlines() or [""])[0][:200]
    return f"This failed inside mechlab ({type(error).__name__}{': ' + first if first else ''}); the mechanism before it is still shown."


def controls(d: Design) -> tuple[Control, ...]:
    """The parameters of a design as they appear in the form of the page; those without a value are left out."""
    found = []
    for item in describe(d.entry.parameters):
        value = getattr(d.parameters, item.name)
        if value is not None:
            found.append(Control(item.name, _text(value), item.unit, item.text))
    return tuple(found)


def _text(value: Any) -> str:
    """A value as text that `parse_value` reads back."""
    if isinstance(value, tuple):
        return ",".join(_text(x) for x in value) + ("," if len(value) == 1 else "")
    return str(value) if isinstance(value, Fraction | str | int) else f"{value:.12g}"
