"""A simulation on a live page, while it runs: a thread runs the scene and sends what the watch sees."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording
from mechlab.study.design import Design
from mechlab.study.run import run_scene
from mechlab.view.from_recording import mechanism_story, placed
from mechlab.view.live import Server
from mechlab.view.story import Story
from mechlab.view.watch import Stopped, Watch, glimpse, watched


def stream(
    server: Server,
    design: Design,
    told: Callable[[Recording], Story],
    scene: str | None = None,
    speed: float = 1.0,
    stop: Callable[[], bool] = lambda: False,
) -> threading.Thread:
    """Runs a scene of the design in a thread, not faster than `speed` times its own time, and shows every browser where
    it is; when it has ended, the page of the recording replaces it. What goes wrong is told on the page. `stop()` true: the
    run is no longer wanted and ends."""
    lived = design.for_scene(scene)
    chosen = scene or design.default_scene
    fidelity = design.entry.scenes[chosen].fidelity

    def over() -> bool:
        return server.closed or stop()

    def see(t: float, plant: Any) -> None:
        now = glimpse(plant, t, fidelity)
        mechanism, q = now.mechanism, now.q
        if lived.entry.expand is not None:
            mechanism, q = lived.entry.expand(lived.parameters, now)
        names, poses, _ = placed(mechanism, q)
        if names != server.story.bodies:
            server.show(mechanism_story(mechanism, design.entry.title))
            return
        server.update(poses[0])

    def work() -> None:
        watch = Watch(see, speed, over)
        try:
            recording = run_scene(replace(design, entry=watched(design.entry, watch)), scene)
            if not over():
                page = told(recording)
                if not over():
                    server.show(page)
        except Stopped:
            return
        except MechlabError as error:
            if not over():
                failed = replace(
                    server.story, health=(*server.story.health, ("error", f"the simulation ended: {error}"))
                )
                server.show(failed)

    thread = threading.Thread(target=work, name="mechlab-stream", daemon=True)
    thread.start()
    return thread
