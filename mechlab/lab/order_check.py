"""The observed order of a run on demand: whether its error falls with the timestep as that of its method should."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.errors import expected_order, observed_order, order_finding
from mechlab.experiment.ranges import limited_parts, met_ends
from mechlab.experiment.recording import Finding, Health, Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.lab.problem_settings import with_static_motors
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import Joint, Shaft

ORDER_STEPS, ORDER_OUTPUTS = 400, 40
"""Number of steps of an order check at the scene's timestep, and of times at which its three runs are compared."""
_CORNERS = ("held_rates", "one_sided_stop", "constant_power", "table")


def fixed_steps(settings: Settings) -> bool:
    """Whether the engine takes the steps of the settings."""
    return settings.engine in ("mujoco", "file", "pinocchio", "one_freedom") and settings.integrator not in ("DOP853", "Radau")


def with_order(recording: Recording, scene: Scene) -> Recording:
    """The recording with the finding "order": its method on the first ORDER_STEPS steps of the scene, at its timestep, half
    and quarter of it."""
    s, m = recording.settings, recording.mechanism
    if not fixed_steps(s):
        text = f"{s.engine} ({s.integrator}) controls its steps by its tolerance {s.tolerance:g}: there is no order to check"
        return replace(recording, health=recording.health + Health((Finding("order", 0.0, 0.0, "", "ok", text),)))
    scene = with_static_motors(scene, s)
    steps = max(1, min(ORDER_STEPS, int(scene.duration / s.timestep + 1e-9)))
    outputs = max(1, min(ORDER_OUTPUTS, steps))
    piece = replace(scene, duration=steps // outputs * outputs * s.timestep)
    expected = expected_order(s, m.is_closed)
    order = observed_order(lambda h: _states(m, piece, replace(s, timestep=h), outputs), s.timestep, expected)
    found = order_finding(order, s.timestep, suspects(m, scene, s))
    return replace(recording, health=recording.health + Health((found,)))


def _states(mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int) -> Array:
    """(n, nq) coordinates at `outputs` + 1 even times; fewer for a run that ended early."""
    try:
        return engine(settings.engine).states(mechanism, scene, settings, outputs)
    except MechlabError:
        return np.zeros((0, mechanism.nq))


def suspects(mechanism: Mechanism, scene: Scene, settings: Settings, run: Recording | None = None) -> Iterator[str]:
    """What is known to lower the order of RK4; the ends of ranges only where the run, if one is given, has come to them."""
    items: list[Joint | Shaft] = [*mechanism.joints, *mechanism.shafts]
    rough = [x.name for x in items if x.friction]
    if rough:
        how = (
            "is a soft row with corners in MuJoCo" if settings.engine == "mujoco" else "is smoothed over a narrow band"
        )
        yield f"the dry friction of {', '.join(rough)}, which {how}"
    stops = [x.name for x in items if x.range is not None] + [x.name for x in mechanism.springs if x.range is not None]
    if run is not None and stops:
        known = [n for n in limited_parts(mechanism) if n in stops]
        met = met_ends(mechanism, known, run.t, run.q, run.v)
        far = {n for n, x in zip(known, met, strict=True) if not x.any()}
        stops = [n for n in stops if n not in far]
    if stops:
        yield f"the ends of the range of {', '.join(stops)}"
    for law in scene.laws:
        if law.kind in _CORNERS or np.isfinite(getattr(law, "limit", np.inf)):
            yield f"the corners of the law {law.kind}"
        elif law.kind not in _BUILT_IN:
            yield f"the law {law.kind}, if it holds its force over a step instead of following the state"


_BUILT_IN = (
    "constant", "harmonic", "servo", "motor", "dc_motor", "viscous", "viscous_between", "computed_torque",
)  # fmt: skip
