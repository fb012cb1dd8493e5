"""A scene of the user's own for a design: given as a Scene, or made of one of its scenes by laws and commands of drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.acting import drive_law
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import DcMotor, FunctionLaw, Law, Laws, Plant, Servo, laws_of
from mechlab.experiment.motion import AtRate, PrescribedMotion, Target, as_motion
from mechlab.experiment.parameters import mechanism_units
from mechlab.experiment.scene import Scene
from mechlab.lab.design import AUTO, Design
from mechlab.mechanism import Mechanism
from mechlab.mechanism.parts import Drive
from mechlab.values import in_unit

Commands = Mapping[str, Target]
"""Drive (or its joint or shaft) -> what it is to follow: see `command_law`."""


def with_scene(design: Design, scene: Scene) -> Design:
    """The design with one more scene, a user's own, as its default; fidelity "" is the design's default one."""
    if not isinstance(scene, Scene):
        raise MechlabError(f"{design.name}: scene: expected the name of a scene or an ml.Scene, got {scene!r}.")
    level = scene.fidelity or design.entry.default_fidelity
    if level != AUTO:
        design.fidelity(level)
    text = scene.text or "a scene of the user's own"
    return _with_recipe(design, scene.name, SceneRecipe(lambda p, fidelity: replace(scene, fidelity=fidelity), level, text))


def with_laws(design: Design, scene: str | None, laws: Laws = (), commands: Commands | None = None) -> Design:
    """The design with the scene (default: its default one) under more laws, and drives that follow commands, as its default scene.

    A law takes the place of what the scene had on the same joint or shaft. Raises MechlabError for a name that does not exist, and
    for a law of the scene that acts on more joints than the user's laws do: half of it cannot be replaced.
    """
    base = scene or design.default_scene
    recipe = design.recipe(base)
    own = laws_of(laws)

    def make(p: Any, fidelity: str) -> Scene:
        before = recipe.make(p, fidelity)
        if fidelity == "kinematic":
            raise MechlabError(f"{design.name}: fidelity 'kinematic' is closed form only; laws act on a mechanism.")
        m = design.entry.build(p, fidelity) if before.file is None else before.file.mechanism
        if before.file is not None:
            controls = {name: file_command(m, name, target) for name, target in (commands or {}).items()}
            return replace(before, laws=(*_remaining(m, before, own), *own), controls={**before.controls, **controls})
        added = (*own, *(command_law(m, name, target) for name, target in (commands or {}).items()))
        return replace(before, laws=(*_remaining(m, before, added), *added))

    return _with_recipe(design, f"{base} with laws", replace(recipe, make=make))


def _with_recipe(design: Design, name: str, recipe: SceneRecipe) -> Design:
    entry = design.entry
    return replace(design, entry=replace(entry, scenes={**entry.scenes, name: recipe}, default_scene=name))


def _remaining(m: Mechanism, scene: Scene, added: tuple[Law, ...]) -> tuple[Law, ...]:
    """The laws of a scene that act on none of the names that the added laws act on."""
    taken: set[str] = set()
    for law in added:
        for name in law.targets():
            if name not in m.scalar_names:
                raise unknown(f"{m.name}: laws: joint or shaft", name, m.scalar_names)
            taken.add(name)
    left = []
    for law in scene.laws:
        both = taken & set(law.targets())
        if not both:
            left.append(law)
        elif rest := set(law.targets()) - taken:
            raise MechlabError(
                f"{m.name}, scene {scene.name}: one law ({law.kind}) commands {', '.join(law.targets())}; laws on "
                f"{', '.join(sorted(both))} alone cannot replace it. Give laws for {', '.join(sorted(rest))} too, or choose another scene."
            )
    return tuple(left)


def command_law(m: Mechanism, name: str, target: Target) -> Law:
    """The law of a drive that follows a command in its own unit, found by the name of the drive or of its joint or shaft.

    With a stiffness: the target value [rad or m]; with damping alone: the target rate [rad/s or m/s]; with a winding: the voltage
    [V]; with none of them: the force [N m or N]. Raises MechlabError for an unknown drive.
    """
    drives = {d.name: d for d in m.drives} | {d.on: d for d in m.drives}
    if name not in drives:
        raise unknown(f"{m.name}: drive", name, [d.name for d in m.drives])
    drive = drives[name]
    law, units = drive_law(m, drive), mechanism_units(m)
    follows = drive.on if drive.stiffness else f"{drive.on}_rate" if drive.damping else f"{drive.on}_force"
    what = f"{m.name}: command of drive {drive.name!r}"
    motion = as_motion(what, target)
    if isinstance(target, str):
        in_unit(what, target, *(("V",) if drive.winding else units[follows]))
    if drive.winding is not None:
        w = drive.winding
        return DcMotor(drive.on, motion, w.constant, w.resistance, w.inductance)
    if isinstance(law, Servo):
        return replace(law, motion=motion if law.stiffness else AtRate(motion), drive="")
    return FunctionLaw(drive.on, _Commanded(drive, motion))


def file_command(m: Mechanism, name: str, target: Target) -> PrescribedMotion:
    """The command of an actuator of a file that is run as it is, a plain number in the units of the file's control. Raises MechlabError
    for a text, whose unit nobody could check."""
    what = f"{m.name}: command of actuator {name!r}"
    if isinstance(target, str):
        raise MechlabError(f"{what}: expected a number, in the units of the file's control, got {target!r}.")
    return as_motion(what, target)


class _Commanded:
    """The force of a drive that is commanded by its force, within its limit."""

    def __init__(self, drive: Drive, motion: PrescribedMotion) -> None:
        self.motion, self.limit = motion, drive.limit
        self.__name__ = f"command of {drive.name}"

    def __call__(self, t: float, plant: Plant) -> float:
        f = self.motion.at(t)[0]
        return f if self.limit is None else min(max(f, -self.limit), self.limit)
