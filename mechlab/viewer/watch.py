"""Watching a simulation while it runs: a law without force that shows where the mechanism is."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.laws import Plant
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene
from mechlab.mechanism.geometry import Array

PICTURES = 25.0
"""Pictures a second that are sent, at most [1/s]."""


@dataclass
class Pace:
    """When the last picture was sent, and when the run began [s, of the wall clock]; times are those of the run."""

    began: float = field(default_factory=time.monotonic)
    shown: float = -1.0
    latest: float = -1.0


@dataclass(frozen=True, eq=False)
class Watch:
    """A law that acts on nothing: `see(t, plant)` is called up to PICTURES times a second of the run, and the run is held
    back so that it takes no less than its own time divided by `speed`. `stop()` true ends it: Stopped is raised."""

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
                raise Stopped
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


class Stopped(Exception):
    """Nobody watches any more."""
