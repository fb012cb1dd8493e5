"""What acts on a mechanism in a scene: gravity, springs, the laws of the scene, and the declared drives; and that in words.

A drive whose joint or shaft has no law holds its target, the reference pose where none is given:

    force = -stiffness (value - target) - damping rate      limited to +-limit
    force = constant (0 - constant rate) / resistance       of a drive with a winding, at no voltage

A drive with damping alone has the target rate 0; one with neither gives no force. So an exported MJCF file moves with all
controls at 0. A law on a driven joint or shaft takes the place of its drive, and a scene may release them all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from mechlab.experiment.laws import DcMotor, Law, Servo
from mechlab.experiment.motion import Hold
from mechlab.experiment.recording import force_unit
from mechlab.experiment.scene import Scene
from mechlab.mechanism.length_unit import is_length
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Drive, Joint, Shaft, Spring

FEW = 6
"""Largest number of names written out; of more names, the first, the last and their number."""


def rounded(names: Sequence[str]) -> str:
    """Names with commas; a long list is shortened to its first and last name and its length."""
    unique = list(dict.fromkeys(names))
    return ", ".join(unique) if len(unique) <= FEW else f"{unique[0]} to {unique[-1]} ({len(unique)})"


def law_text(mechanism: Mechanism, laws: Sequence[Law]) -> str:
    """Text of a law, or of several laws that differ only in their joint or shaft."""
    law: Any = laws[0]
    on = rounded([name for x in laws for name in x.targets()])
    length, word = ("m", "force") if is_length(mechanism, law.targets()[0]) else ("rad", "torque")
    unit = force_unit(length)
    many = "s" if len(laws) > 1 else ""
    match law.kind:
        case "servo":
            return _servo(law, on, length, unit, many)
        case "dc_motor":
            return f"DC motor{many} {on} at {'a voltage over time' if callable(getattr(law.voltage, 'at', None)) else f'{law.voltage:g} V'}"
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
        case "function":
            return f"the user's function {law.name} on {on}"
        case "computed_torque":
            return f"computed torque of {on}"
        case "held_rates":
            return "; ".join([*(law_text(mechanism, [x]) for x in law.laws if x.targets()), *(_hold(mechanism, h) for h in law.holds)])
        case "viscous_between":
            return f"drag {law.coefficient:g} {unit} s/{length} between {law.a} and {law.b}"
    return f"{law.kind.replace('_', ' ')} on {on}"


def _hold(mechanism: Mechanism, hold: Any) -> str:
    """A hold of a rate by its bounds: dry friction, a one-way stop, or a rate that is kept."""
    terms = (f"{'-' if c < 0.0 else '+'} {'' if abs(c) == 1.0 else f'{abs(c):g} '}{n}" for n, c in hold.terms)
    on = " ".join(terms).removeprefix("+ ")
    length = "m" if is_length(mechanism, hold.terms[0][0]) else "rad"
    unit = force_unit(length)
    if hold.high == -hold.low and math.isfinite(hold.high) and not hold.rate:
        return f"dry friction {hold.high:g} {unit} on {on}"
    limits = f" by {hold.low:g} to {hold.high:g} {unit}" if math.isfinite(hold.low) or math.isfinite(hold.high) else ""
    if 0.0 in (hold.low, hold.high):
        what = f"{'at least' if hold.low == 0.0 else 'at most'} {hold.rate:g} {length}/s"
        return f"one-way stop: rate of {on} {what}" + (limits if math.isfinite(hold.high - hold.low) else "")
    return f"rate of {on} held at {hold.rate:g} {length}/s{limits}"


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


def drive_law(mechanism: Mechanism, drive: Drive) -> Law | None:
    """The law by which a drive holds its target, or None where it gives no force."""
    if drive.winding is not None:
        w = drive.winding
        if not w.constant:
            return None
        return DcMotor(drive.on, 0.0, w.constant, w.resistance, w.inductance, drive=drive.name)
    if not (drive.stiffness or drive.damping):
        return None
    limit = math.inf if drive.limit is None else drive.limit
    target = mechanism.zero(drive.on) if drive.target is None else drive.target
    return Servo(drive.on, Hold(target), drive.stiffness, drive.damping, limit=limit, drive=drive.name)


def acting(mechanism: Mechanism, scene: Scene) -> Scene:
    """The scene with a law for every drive that it neither releases nor replaces by a law on the same joint or shaft.

    A second call changes nothing: the laws of the first call count as laws of the scene.
    """
    if scene.drives == "free" or not mechanism.drives:
        return scene
    taken = {name for law in scene.laws for name in law.targets()}
    held = [drive_law(mechanism, d) for d in mechanism.drives if d.on not in taken]
    return replace(scene, laws=(*scene.laws, *(x for x in held if x is not None)))


def held_drives(laws: Sequence[Law]) -> tuple[Servo | DcMotor, ...]:
    """The laws among `laws` that are declared drives."""
    return tuple(x for x in laws if isinstance(x, Servo | DcMotor) and x.drive)


def what_acts(mechanism: Mechanism, scene: Scene) -> str:
    """One line on what acts in a scene; `scene` is a result of `acting`."""
    parts = ["gravity" if any(mechanism.gravity) else "no gravity", *_elements(mechanism)]
    held = held_drives(scene.laws)
    alike: dict[Law, list[Law]] = {}
    for hold in held:
        alike.setdefault(replace(hold, drive="", on=""), []).append(hold)
    parts += [law_text(mechanism, group) for group in alike.values()]
    others = [law for law in scene.laws if law not in held and law.targets()]
    names = {law.drive for law in held}
    waiting = [d for d in mechanism.drives if d.name not in names]
    for law in others:
        taken = [d for d in waiting if d.on in law.targets()]
        waiting = [d for d in waiting if d not in taken]
        replaced = sum(drive_law(mechanism, d) is not None for d in taken) if scene.drives == "hold" else 0
        words = ("", " in place of its drive", " in place of their drives")[min(replaced, 2)]
        parts.append(law_text(mechanism, [law]) + words)
    return "; ".join([*parts, *_idle(mechanism, waiting)])


def _elements(mechanism: Mechanism) -> list[str]:
    """Texts on the springs, dampers and dry friction of the mechanism."""
    parts: list[Joint | Shaft] = [*mechanism.joints, *mechanism.shafts]
    elastic: list[Joint | Shaft | Spring] = [*mechanism.springs, *parts]
    springs = [x.name for x in elastic if x.stiffness]
    found = {
        "spring" if len(springs) == 1 else "springs": springs,
        "damping of": [x.name for x in elastic if x.damping],
        "dry friction of": [x.name for x in parts if x.friction],
    }
    return [f"{what} {rounded(names)}" for what, names in found.items() if names]


def _idle(mechanism: Mechanism, rest: Sequence[Drive]) -> list[str]:
    """Texts on drives that neither hold nor are replaced by a law: released ones, and ones that give no force."""
    able = [d for d in rest if drive_law(mechanism, d) is not None]
    out = []
    for drives, text in ((able, "released"), ([d for d in rest if d not in able], "without a command")):
        if drives:
            out.append(f"{'drive' if len(drives) == 1 else 'drives'} {rounded([d.name for d in drives])} {text}")
    return out


SMOOTH_LAWS = ("constant", "harmonic", "table", "servo", "viscous", "constant_power")
"""Kinds of laws without memory and without kinks."""


def is_rough(mechanism: Mechanism) -> bool:
    """Whether a joint or shaft has dry friction."""
    return any(j.friction for j in mechanism.joints) or any(s.friction for s in mechanism.shafts)


def why_no_smooth_tree(mechanism: Mechanism, laws: tuple[Law, ...]) -> str:
    """Why it is not a tree of one-coordinate joints without dry friction under smooth laws; "" when it is."""
    m = mechanism
    if m.is_closed:
        return "it has loops or gears"
    if is_rough(m) or any(j.nv != 1 for j in m.joints) or any(s.inertia or s.damping or s.stiffness for s in m.shafts):
        return "its joints or shafts are of other kinds, or have dry friction"
    other = [law.kind for law in laws if law.kind not in SMOOTH_LAWS]
    return f"a law of kind {other[0]}" if other else ""
