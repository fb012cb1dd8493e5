"""A run whose tracked channels of one unit are within an error in that unit: a power within 1 W, a force within 1 N.

The error of a channel falls as that of the positions does, which is what error control refines: the positions are asked for more
until the stated errors of the channels meet what is asked of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Finding, Health, Recording
from mechlab.experiment.scene import Scene
from mechlab.integrate import work_done
from mechlab.values import Quantity

FIRST = 1e-3
"""The first error asked of the positions [m or rad]."""
ROUNDS = 5
SHARE = 0.4
"""Share of the error asked for at which the next round aims."""
STUCK = 0.7
"""A round that leaves more than this share of the error before it has met something that the positions do not control."""
NAMED = 4

Once = Callable[[float, float], Recording]
"""A run with its channel errors, from the error of the positions [m or rad] and the budget [s]."""


def run_to_channel_error(name: str, scene: Scene, wanted: Quantity, once: Once, budget: float) -> Recording:
    """The run whose tracked channels in the unit of `wanted` are off by at most that, or one whose finding "max_error" says why not.

    Tracked are the channels that the scene names; all where it names none. Raises MechlabError where none has that unit,
    listing theirs.
    """
    if not wanted > 0.0:
        raise MechlabError(f"max_error: expected a number > 0, got {wanted.written}.")
    target, left = FIRST, budget
    best: tuple[float, str, Recording] | None = None
    names: list[str] = []
    why = ""
    for _ in range(ROUNDS):
        before = work_done()
        made = once(target, left)
        left -= work_done() - before
        names = _in_unit(name, scene, made, wanted)
        worst = max(names, key=lambda n: made.errors.get(n, math.inf))
        error, positions = made.errors.get(worst, math.inf), made.health.finding("max_error")
        stuck = best is not None and error > STUCK * best[0]
        if best is None or error < best[0]:
            best = error, worst, made
        if error <= wanted:
            break
        if not math.isfinite(error):
            why = f"no second run tells the error of {worst}"
        elif stuck:
            why = f"the error of {worst} does not fall with that of the positions: it jumps or bends where the motion does"
        elif left <= 0.0:
            why = f"the budget of {budget:.3g} s is used up"
        elif positions.value > positions.limit or not positions.value > 0.0:
            why = "the positions cannot be made sharper"
        if why:
            break
        target = SHARE * wanted / error * positions.value
    assert best is not None
    return _stated(best, names, wanted, why or f"{ROUNDS} rounds were made")


def _in_unit(name: str, scene: Scene, made: Recording, wanted: Quantity) -> list[str]:
    """The tracked channels in the unit of `wanted`."""
    tracked = [n for n in scene.channels if n in made.channels] or list(made.channels)
    names = [n for n in tracked if made.units.get(n) == wanted.unit]
    if not names:
        units = dict.fromkeys(made.units[n] for n in tracked if made.units.get(n))
        raise MechlabError(
            f"{name}: max_error {wanted.written}: no tracked channel is in {wanted.unit}; those of the scene are in {', '.join(units)}. "
            "A plain number is of the positions [m or rad]."
        )
    return names


def _stated(best: tuple[float, str, Recording], names: list[str], wanted: Quantity, why: str) -> Recording:
    """The recording with the finding "max_error" of its channels in place of that of its positions."""
    error, worst, made = best
    positions = made.health.finding("max_error")
    met = error <= wanted
    contradicted = positions.severity == "error" and positions.value <= positions.limit
    shown = ", ".join(names) if len(names) <= NAMED else f"all {len(names)} channels in {wanted.unit}"
    text = f"error of {shown} estimated at {error:.2g} {wanted.unit}" + ("" if len(names) == 1 else f" ({worst})")
    text += f" ({float(wanted):g} {wanted.unit} asked for)"
    text += "" if met else f"; the error asked for cannot be reached: {why}; do not trust this run"
    text += f". The positions: {positions.sentence}"
    severity = "ok" if met and not contradicted else "error"
    finding = Finding("max_error", error, float(wanted), wanted.unit, severity, text)
    others = tuple(f for f in made.health.findings if f.name != "max_error")
    return replace(made, health=Health((finding, *others)))
