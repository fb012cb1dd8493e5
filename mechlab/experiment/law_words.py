"""Laws in words, for the line that says what acts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from mechlab.experiment.laws import Law
from mechlab.experiment.motion import Hold
from mechlab.mechanism.model import Mechanism

FEW = 6
"""So many names are written out; of more the first, the last and their number."""


def rounded(names: Sequence[str]) -> str:
    """Names in a row, a long row shortened."""
    unique = list(dict.fromkeys(names))
    return ", ".join(unique) if len(unique) <= FEW else f"{unique[0]} to {unique[-1]} ({len(unique)})"


def law_text(mechanism: Mechanism, laws: Sequence[Law]) -> str:
    """A law in words, or several of equal numbers on different joints or shafts."""
    law: Any = laws[0]
    on = rounded([name for x in laws for name in x.targets()])
    slides = {j.name for j in mechanism.joints if j.kind == "prismatic"}
    length, word = ("m", "force") if law.targets()[0] in slides else ("rad", "torque")
    unit = "N" if length == "m" else "N m"
    many = "s" if len(laws) > 1 else ""
    match law.kind:
        case "servo":
            return _servo(law, on, length, unit, many)
        case "dc_motor":
            return f"DC motor{many} {on} at {law.voltage:g} V"
        case "motor":
            return f"motor {on}, stall {law.stall:g} {unit}, no load {law.no_load_rate:g} {length}/s"
        case "constant":
            return f"constant {word} {law.value:g} {unit} on {on}"
        case "harmonic":
            offset = f"{law.offset:g} + " if law.offset else ""
            phase = f" + {law.phase:g}" if law.phase else ""
            return f"{word} {offset}{law.amplitude:g} sin({law.frequency:g} t{phase}) {unit} on {on}"
        case "table":
            return f"{word} from a table on {on}"
        case "constant_power":
            return f"constant power {law.power:g} W on {on}, at most {law.limit:g} {unit}"
        case "viscous":
            return f"drag {law.coefficient:g} {unit} s/{length} on {on}"
        case "one_sided_stop":
            return f"stop of {on} at {law.at:g} {length}, {law.stiffness:g} {unit}/{length}"
        case "computed_torque":
            return f"computed torque of {on}"
    return f"{law.kind.replace('_', ' ')} on {on}"


def _servo(law: Any, on: str, length: str, unit: str, many: str) -> str:
    damping = f"{law.damping:g} {unit} s/{length}"
    if law.drive and not law.stiffness:
        return f"drive{many} {on} {damping}, target rate 0{_limit(law, unit)}"
    gains = ", ".join([f"{law.stiffness:g} {unit}/{length}", *([damping] if law.damping else [])])
    target = f"held at {law.motion.value:g}" if isinstance(law.motion, Hold) else "on its motion"
    if isinstance(law.motion, Hold) and law.motion.value:
        target += f" {length}"
    more = f", {law.feedforward:g} {unit} besides" if law.feedforward else ""
    return f"servo{many} {on} {gains}, {target}{more}{_limit(law, unit)}"


def _limit(law: Any, unit: str) -> str:
    return f", at most {law.limit:g} {unit}" if math.isfinite(law.limit) else ""


__all__ = ["law_text", "rounded"]
