"""One run of a scene by the engine that its settings name."""

from __future__ import annotations

from collections.abc import Sequence

from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.witness import room
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array


def run_by_engine(
    mechanism: Mechanism, scene: Scene, settings: Settings, times: Sequence[float] | Array | None = None
) -> Recording:
    """The scene by `settings.engine`, sampled at `times` [s] at least; raises what the runner of the engine raises."""
    if settings.engine == "hybrid":
        room("pinocchio")
        from mechlab.engines.own.hybrid import run as run_hybrid

        return run_hybrid(mechanism, scene, settings, times)
    if settings.engine == "one_freedom":
        from mechlab.engines.own.one_freedom import run as run_one_freedom

        return run_one_freedom(mechanism, scene, settings, times)
    found: Recording = room(settings.engine).run(mechanism, scene, settings, times)
    return found
