"""A design: an entry with chosen parameters. It makes mechanisms, scenes and engine models; it is what `load` gives."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from mechlab.engines.protocol import available, engine
from mechlab.errors import MechlabError, NoSolution, explained, unknown, warn
from mechlab.experiment.acting import acting
from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.laws import Constant
from mechlab.experiment.laws.user import check_units, with_units
from mechlab.experiment.model_file import LeftOut
from mechlab.experiment.parameters import checked, describe, make, mechanism_units, of_mechanism
from mechlab.experiment.scene import Scene, Settings
from mechlab.lab.own_mechanism import AS_IS, FREE, HOLD, holding
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.structure import Structure, structure
from mechlab.results import Shown

if TYPE_CHECKING:
    from mechlab.engines.closer import Closer
    from mechlab.engines.mujoco.form import MujocoForm
    from mechlab.engines.pinocchio.form import PinocchioForm

AUTO = "auto"
"""Fidelity of a scene or a run: the cheapest that answers what is needed; `mechlab.lab.fidelity.choose` finds it."""


LONGEST = 1e6
"""Longest simulated time [s] of a run."""


OUT_OF_DOMAIN = ("math domain error", "expected a n")
"""How messages begin of a square root or arc cosine that has no value, in old and new versions of Python."""


@contextmanager
def reaching(design: Design) -> Iterator[None]:
    """Raises NoSolution where a square root or arc cosine in the block has no value: lengths of the design do not reach each other."""
    try:
        yield
    except ValueError as error:
        if not str(error).startswith(OUT_OF_DOMAIN):
            raise
        given = ", ".join(f"{k}={v}" for k, v in design.given.items()) or "its default parameters"
        raise NoSolution(
            f"{design.name}: it cannot be put together with {given}: lengths do not reach each other. Take values nearer to the "
            "defaults, or change others with them."
        ) from error


@explained
@dataclass(frozen=True, repr=False)
class Design(Shown):
    """An entry and its parameters. `given` are the parameters that the user set (they outrank those of a scene)."""

    entry: Entry
    parameters: Any
    given: Mapping[str, Any]

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.entry.name

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on doubtful parameters."""
        return self.entry.warnings(self.parameters) if self.entry.warnings else ()

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """What of the model file the mechanism does not hold; empty without a file."""
        return self.entry.file.left_out if self.entry.file else ()

    def fidelity(self, fidelity: str | None = None) -> str:
        """The fidelity asked for, or the default one; raises MechlabError that lists them."""
        if fidelity is None:
            return self.entry.default_fidelity
        if fidelity not in self.entry.fidelities:
            raise unknown(f"{self.name}: fidelity", fidelity, self.entry.fidelities)
        return fidelity

    def mechanism(self, fidelity: str | None = None) -> Mechanism:
        """The mechanism at a fidelity. Raises MechlabError for `kinematic`, which is closed form only."""
        chosen = self.fidelity(fidelity)
        if chosen == "kinematic":
            others = [f for f in self.entry.fidelities if f != "kinematic"]
            raise MechlabError(
                f"{self.name}: fidelity 'kinematic' is closed form only and has no Mechanism; the cheapest that has one is {others[0]!r}."
            )
        with reaching(self):
            return self.entry.build(of_mechanism(self.parameters), chosen)

    def moving(self, scene: Scene) -> Mechanism:
        """The mechanism whose motion a run of the scene records: that of the file that it runs as it is, or else that of its fidelity."""
        return self.mechanism(scene.fidelity) if scene.file is None else scene.file.mechanism

    def drawn(self) -> Mechanism:
        """What a picture shows that stands still: the richest fidelity, or the bodies of a file that no Mechanism holds."""
        file = self.entry.file
        return file.mechanism if file is not None and file.unheld else self.mechanism(list(self.entry.fidelities)[-1])

    def structure(self, fidelity: str | None = None) -> Structure:
        """Degrees of freedom, redundancies, independent coordinates."""
        return structure(self.mechanism(fidelity))

    def to_mujoco(self, fidelity: str | None = None, settings: Settings | None = None) -> MujocoForm:
        """(MjModel, MjData) of the generated MJCF, ready to step; with `engine_state` and `named_state`, which convert states between
        the names and physical values of the mechanism and the engine's qpos and qvel. See `mechlab.engines.mujoco.form`."""
        engine("mujoco")  # raises EngineMissing where it is not installed
        from mechlab.engines.mujoco.form import MujocoForm

        return MujocoForm(self.mechanism(fidelity), settings)

    def to_pinocchio(self, fidelity: str | None = None) -> PinocchioForm:
        """(pinocchio.Model, ConstraintSet): the tree, and what closes and couples it; with `rigid_constraints` for Pinocchio's own
        constrained dynamics, `rows(q, v)` -> J, dJ/dt v for what it cannot express, `mass_matrix`, `bias`, and `engine_state`,
        `named_state`, which convert states. See `mechlab.engines.pinocchio.form`."""
        engine("pinocchio")  # raises EngineMissing where it is not installed
        from mechlab.engines.pinocchio.form import PinocchioForm

        return PinocchioForm(self.mechanism(fidelity))

    def closer(
        self, *names: str, engine: str = "", fidelity: str | None = None, frames: Sequence[str] = ()
    ) -> Closer:
        """A function that closes the mechanism where the named joints, shafts or points (FRAME_x) have given values, and keeps what it
        needs: a pose of a path costs some 60 to 100 us (tests/benchmarks/bench_closer.py), an array of them less.

            closer = ml.load("fourbar").closer("crank_angle")
            closer(crank_angle=1.2)["rocker_angle"]

        names: default those of the drives. engine: numpy, pinocchio, mujoco; default Pinocchio where it is installed. frames: Frames
        whose motion is computed as well. See `mechlab.engines.closer`. Raises MechlabError for an unknown name, EngineMissing.
        """
        from mechlab.engines.closer import Closer

        m = self.mechanism(fidelity)
        chosen = engine or ("numpy" if available("pinocchio") else "pinocchio")
        return Closer(m, names or tuple(dict.fromkeys(d.on for d in m.drives)), chosen, frames)

    def save(self, out: Any, fidelity: str | None = None) -> dict[str, Any]:
        """Write NAME.xml, scene.xml, NAME.urdf, NAME.json and geometry; each is reloaded by its consumer first.

        Warns (UserWarning) where NAME.xml says another timestep or integrator than `file_settings`, because it needs that to
        run in plain MuJoCo, or where none was found with which it runs.
        """
        from mechlab.lab.generate import write_verified  # loads MuJoCo

        made = write_verified(self.mechanism(fidelity), out, self.file_settings)
        for text in made.trial.warnings:
            warn(f"{self.name}: {text}")
        return made.files

    @property
    def file_settings(self) -> Settings:
        """Timestep and integrator that the MJCF file asks for: those of the default scene where MuJoCo runs it."""
        settings = self.scene(fidelity=self.entry.default_fidelity).settings
        return settings if settings.engine == "mujoco" else Settings()

    def show(self, fidelity: str | None = None) -> None:
        """Print parameters, bodies, freedoms, scenes and questions."""
        print(AtFidelity(self, fidelity).text())

    # -- scenes --------------------------------------------------------------------------------------------------------

    @cached_property
    def default_scene(self) -> str:
        """The scene run when none is named: that of the entry, but `free-motion` for `hold` where no drive holds."""
        chosen = self.entry.default_scene
        if chosen == HOLD and FREE in self.entry.scenes and not holding(self.mechanism(self.entry.default_fidelity)):
            return FREE
        return chosen

    def scene_for(self, engine: str | None = None) -> str:
        """The scene that a run without a scene's name is of, for an engine: a stranger's MJCF file is run as it is, unless another
        engine than `file` is asked for."""
        of_file = AS_IS in self.entry.scenes and self.entry.default_scene in (HOLD, FREE) and engine in (None, "file")
        return AS_IS if of_file else self.default_scene

    def scene(
        self,
        name: str | None = None,
        fidelity: str | None = None,
        duration: float | None = None,
        extra: Mapping[str, float] | None = None,
    ) -> Scene:
        """A scene with the user's changes, and what the declared drives do in it (`mechlab.experiment.acting`). `extra`
        holds initial values X_0, X_rate_0 and constant loads X_force, which act in addition to everything else.

        Parameters of the scene outrank defaults, those that the user gave outrank the scene's.
        Raises MechlabError for unknown names, and for a number of a law in a unit that does not fit its joint or shaft.
        """
        chosen = name or self.default_scene
        recipe = self.recipe(chosen)
        p = replace(self.parameters, **{k: v for k, v in recipe.overrides.items() if k not in self.given})
        level = self._level(fidelity or recipe.fidelity, chosen)
        with reaching(self):
            scene = recipe.make(p, level)
        if duration is not None:
            if not duration > 0.0:
                raise MechlabError(f"{self.name}: duration must be positive, got {duration:g} s.")
            if not duration <= LONGEST:
                raise MechlabError(f"{self.name}: duration must be at most {LONGEST:g} s, got {duration:g} s.")
            scene = replace(scene, duration=duration)
        if level != "kinematic" and scene.drives == "hold" and scene.file is None:
            scene = acting(self.mechanism(level), scene)
        if level != "kinematic" and (written := [law for law in scene.laws if with_units(law)]):
            m = self.mechanism(level) if scene.file is None else scene.file.mechanism
            for law in written:
                check_units(law, m)
        return replace(with_extra(self, scene, extra or {}), name=chosen)

    def recipe(self, name: str | None) -> SceneRecipe:
        """The recipe of a scene (default: the entry's); raises MechlabError that lists the scenes."""
        chosen = name or self.default_scene
        if chosen not in self.entry.scenes:
            raise unknown(f"{self.name}: scene", chosen, self.entry.scenes)
        return self.entry.scenes[chosen]

    def _level(self, fidelity: str, scene: str) -> str:
        if fidelity == AUTO:
            raise MechlabError(
                f"{self.name}, scene {scene}: which fidelity is the cheapest that answers is found by running it. Name one of "
                f"{', '.join(self.entry.fidelities)}, or choose first with mechlab.lab.fidelity.choose.chosen_scene."
            )
        return self.fidelity(fidelity)

    def for_scene(self, name: str | None) -> Design:
        """The same design with the overrides of a scene taken into its parameters."""
        changes = {k: v for k, v in self.recipe(name).overrides.items() if k not in self.given}
        return replace(self, parameters=replace(self.parameters, **changes))


@dataclass(frozen=True, repr=False)
class AtFidelity(Shown):
    """A design as it is at one of its fidelities (None: the default one): what `Design.show` prints."""

    design: Design
    fidelity: str | None


def without_effect(base: Design, changes: Mapping[str, Any], fidelity: str | None = None) -> tuple[str, ...]:
    """Those of the changed parameters that do not change the mechanism, because only scenes use them."""
    made = design(base.entry, dict(base.given) | dict(changes))
    moved = [k for k in changes if getattr(made.parameters, k) != getattr(base.parameters, k)]
    if not moved:
        return ()
    whole = made.mechanism(fidelity)
    out = []
    for key in moved:
        less = {k: v for k, v in changes.items() if k != key}
        try:
            if design(base.entry, dict(base.given) | less).mechanism(fidelity) == whole:
                out.append(key)
        except MechlabError:  # the other changes are not valid without this one
            continue
    return tuple(out)


def initial_keys(mechanism: Mechanism) -> tuple[str, ...]:
    """Keys of a simulation that are no parameters: X_0, X_rate_0, X_force for every joint and shaft X."""
    return tuple(f"{n}{s}" for n in mechanism.scalar_names for s in ("_0", "_rate_0", "_force"))


def with_extra(design: Design, scene: Scene, extra: Mapping[str, float]) -> Scene:
    """The scene with initial values X_0, X_rate_0 and constant loads X_force added; raises MechlabError for other keys."""
    if not extra:
        return scene
    m = design.moving(scene)
    names = set(m.scalar_names)
    extra = checked(extra, mechanism_units(m))
    initial, rates, laws = dict(scene.initial), dict(scene.initial_rates), list(scene.laws)
    for key, value in extra.items():
        for suffix, take in (("_rate_0", rates), ("_0", initial)):
            if key.endswith(suffix) and key.removesuffix(suffix) in names:
                take[key.removesuffix(suffix)] = float(value)
                break
        else:
            if key.endswith("_force") and key.removesuffix("_force") in names:
                laws.append(Constant(key.removesuffix("_force"), float(value)))
                continue
            raise unknown(
                f"{design.name}: quantity",
                key,
                {*initial_keys(m), *(i.name for i in describe(design.entry.parameters))},
            )
    return replace(scene, initial=initial, initial_rates=rates, laws=tuple(laws))


def design(entry: Entry, values: Mapping[str, Any]) -> Design:
    """A design from an entry and parameter values; raises MechlabError for unknown names or values out of range."""
    chosen = make(entry.parameters, values, entry.name)
    given = {k: getattr(chosen, k) for k in values}
    return Design(entry, chosen, given)
