"""States of laws, such as the current of a motor, which the engine integrates together with the motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mechlab.experiment.laws import Law, Plant
from mechlab.mechanism.geometry import Array


class LawStates:
    """The states of all laws that have any, as one vector (size,).

    Such a law has `start()`, its states at t = 0; `state_rate(t, plant, state)`, their time derivative; and
    `after(t, plant, state, h)`, the states after h seconds in the present state of the mechanism. The plants of the
    engines hold the states in `memory`, keyed by the law; on a plant without them a law uses its start states.
    """

    def __init__(self, laws: Sequence[Law]) -> None:
        self.laws: list[Any] = []
        self.slices: list[slice] = []
        start: list[float] = []
        for law in laws:
            states = tuple(getattr(law, "start", tuple)())
            if states:
                self.laws.append(law)
                self.slices.append(slice(len(start), len(start) + len(states)))
                start += states
        self.initial = np.array(start)

    def __len__(self) -> int:
        return len(self.initial)

    def put(self, plant: Any, state: Array) -> None:
        """Store the states (size,) in the memory of the plant, where the laws read them."""
        plant.memory = {law: state[s] for law, s in zip(self.laws, self.slices, strict=True)}

    def rate(self, t: float, plant: Plant, state: Array) -> Array:
        """(size,) time derivative of the states."""
        parts = [law.state_rate(t, plant, state[s]) for law, s in zip(self.laws, self.slices, strict=True)]
        return np.concatenate(parts) if parts else np.zeros(0)

    def after(self, t: float, plant: Plant, state: Array, h: float) -> Array:
        """(size,) states after h seconds in the present state of the mechanism."""
        parts = [law.after(t, plant, state[s], h) for law, s in zip(self.laws, self.slices, strict=True)]
        return np.concatenate(parts) if parts else np.zeros(0)
