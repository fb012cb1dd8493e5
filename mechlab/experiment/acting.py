"""What acts on a mechanism in a scene: gravity, springs, the laws of the scene, and the declared drives.

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

from mechlab.experiment.law_words import law_text, rounded
from mechlab.experiment.laws import DcMotor, Law, Servo
from mechlab.experiment.motion import Hold
from mechlab.experiment.scene import Scene
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Drive, Joint, Shaft, Spring


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
    """The scene with a law for every drive that holds: those that the scene neither releases nor replaces by a law on the
    same joint or shaft. What a scene has of them already stays, so that it may be called twice."""
    if scene.drives == "free" or not mechanism.drives:
        return scene
    taken = {name for law in scene.laws for name in law.targets()}
    held = [drive_law(mechanism, d) for d in mechanism.drives if d.on not in taken]
    return replace(scene, laws=(*scene.laws, *(x for x in held if x is not None)))


def held_drives(laws: Sequence[Law]) -> tuple[Servo | DcMotor, ...]:
    """The laws among `laws` that are declared drives."""
    return tuple(x for x in laws if isinstance(x, Servo | DcMotor) and x.drive)


def what_acts(mechanism: Mechanism, scene: Scene) -> str:
    """What acts in a scene, in one line; `scene` is one that `acting` has made."""
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
        taken = [d for d in waiting if d.on in law.targets()] if scene.drives == "hold" else []
        waiting = [d for d in waiting if d not in taken]
        replaced = sum(drive_law(mechanism, d) is not None for d in taken)
        words = ("", " in place of its drive", " in place of their drives")[min(replaced, 2)]
        parts.append(law_text(mechanism, [law]) + words)
    return "; ".join([*parts, *_idle(mechanism, waiting)])


def _elements(mechanism: Mechanism) -> list[str]:
    """Springs, dampers and dry friction of the mechanism."""
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
    """What the drives do that neither hold nor have a law in their place: released, or without a command."""
    able = [d for d in rest if drive_law(mechanism, d) is not None]
    out = []
    for drives, text in ((able, "released"), ([d for d in rest if d not in able], "without a command")):
        if drives:
            out.append(f"{'drive' if len(drives) == 1 else 'drives'} {rounded([d.name for d in drives])} {text}")
    return out


__all__ = ["acting", "drive_law", "held_drives", "what_acts"]
