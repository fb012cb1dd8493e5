"""Changing parameters on the live page: each change makes a new design, which is simulated and streamed like the first."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from mechlab.errors import MechlabError
from mechlab.experiment.parameters import describe
from mechlab.experiment.recording import Recording
from mechlab.lab.design import Design, design
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.values import parse_value
from mechlab.viewer.live import Control, Server, stream
from mechlab.viewer.story import Story

PATIENCE = 20.0
"""How long a run that is no longer wanted may take to end [s]."""

Reply = Callable[[str], None]


class Rebuilder:
    """The design that a live page shows, its running simulation, and the thread that replaces both when a browser sends
    parameters. Only the latest wish counts."""

    def __init__(
        self, server: Server, first: Design, still: Callable[[Design], Story], told: Callable[[Recording], Story]
    ) -> None:
        self.server, self.design, self.still, self.told = server, first, still, told
        self._wishes: queue.Queue[tuple[Mapping[str, str], Reply]] = queue.Queue()
        self._stop = threading.Event()
        self._run = stream(server, first, told, stop=self._stop.is_set)
        server.controls = controls(first)
        server.on_values = lambda values, reply: self._wishes.put((values, reply))
        self._thread = threading.Thread(target=self._work, name="mechlab-rebuild", daemon=True)
        self._thread.start()

    def _work(self) -> None:
        while not self.server.closed:
            try:
                values, reply = self._wishes.get(timeout=0.2)
            except queue.Empty:
                continue
            try:
                self._rebuild(values)
            except MechlabError as error:
                reply(str(error))

    def _rebuild(self, values: Mapping[str, str]) -> None:
        """Raises MechlabError for values that make no mechanism; then the old one stays and runs on."""
        asked = {key: parse_value(key, text) for key, text in values.items()}
        changed = design(self.design.entry, dict(self.design.given) | asked)
        story = self.still(changed)
        chosen_scene(changed)
        self._stop.set()
        self._run.join(PATIENCE)
        self._stop = threading.Event()
        self.design, self.server.controls = changed, controls(changed)
        self.server.show(story)
        self._run = stream(self.server, changed, self.told, stop=self._stop.is_set)


def controls(d: Design) -> tuple[Control, ...]:
    """The parameters of a design as the page's form shows them; those without a value are left out."""
    found = []
    for item in describe(d.entry.parameters):
        value = getattr(d.parameters, item.name)
        if value is not None:
            found.append(Control(item.name, _text(value), item.unit, item.text))
    return tuple(found)


def _text(value: Any) -> str:
    """A value as it can be typed again."""
    if isinstance(value, tuple):
        return ",".join(_text(x) for x in value) + ("," if len(value) == 1 else "")
    return str(value) if isinstance(value, Fraction | str | int) else f"{value:.12g}"
