"""Entries for mechanisms that stand in no catalog: a bare Mechanism, a user's function, a user's class of parameters; and the
scenes that these declare.

    @ml.scene(of=rocker)                      # rocker(crank=0.1, ...) -> Mechanism
    def motor_start(p):                       # p.crank, ...: the parameters
        return ml.Scene(duration=3, laws=(ml.Motor("crank_angle", 2, 30),))

declares the scene `motor-start`. In a class, `@ml.scene` stands above a method; `self` holds the parameters.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, asdict, field, is_dataclass, make_dataclass, replace
from dataclasses import fields as dataclass_fields
from fractions import Fraction
from typing import Any, TypeVar, overload

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError, explained
from mechlab.experiment.acting import drive_law
from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.model_file import ModelFile
from mechlab.experiment.scene import Scene
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.naming import refuse_parameters

HOLD, FREE = "hold", "free-motion"
"""The scenes that every mechanism without an entry has: its drives hold their targets, or are released."""
AS_IS = "as-is"
"""The scene of somebody's MJCF file, run by MuJoCo as the file is."""
FILE_TOLERANCE = 1e-2
"""Largest error [m or rad] of a run of such a file: soft contacts are not meant to be better."""
LEVEL = "full"
"""The one fidelity of such a mechanism."""

Guard = Callable[[Callable[[], Any]], Any]
"""Calls a function of the user; what it raises may be told in other words."""


def plainly(work: Callable[[], Any]) -> Any:
    """A Guard that lets errors pass."""
    return work()


@dataclass(frozen=True)
class NoParameters:
    """A bare Mechanism has no parameters."""


def entry_of(mechanism: Mechanism, file: ModelFile | None = None) -> Entry:
    """An entry for a bare Mechanism: one fidelity; the scene `hold` where a drive holds, and `free-motion`. file: that it was
    read from; a stranger's MJCF file has the scene `as-is`, too, or alone where no Mechanism holds it."""
    if file is not None and file.unheld:
        return _unheld(file)
    made = _entry(mechanism.name, NoParameters, lambda p, fidelity: mechanism, mechanism.summary, {})
    if not holding(mechanism):
        made = replace(made, scenes={FREE: made.scenes[FREE]}, default_scene=FREE)
    if file is None or file.ours or not file.joints:
        return replace(made, file=file)
    return replace(made, file=file, scenes={**made.scenes, AS_IS: _as_is(file)})


def _as_is(file: ModelFile) -> SceneRecipe:
    text = "the file as MuJoCo runs it: its contacts, actuators, timestep and softness"

    def make(p: Any, fidelity: str) -> Scene:
        settings = engine("file").settings(file)
        return Scene(AS_IS, fidelity, 2.0, tolerance=FILE_TOLERANCE, settings=settings, text=text, file=file)

    return SceneRecipe(make, LEVEL, text)


def _unheld(file: ModelFile) -> Entry:
    """An entry for a file that no Mechanism holds: it has no mechanism, and the scene `as-is` alone."""

    def build(p: Any, fidelity: str) -> Mechanism:
        raise MechlabError(
            f"{file.name}: no Mechanism holds this file, which this needs; simulate, view, session and doctor take it as MuJoCo does. "
            f"The reason: {file.unheld}"
        )

    made = _entry(file.mechanism.name, NoParameters, build, "", {})
    return replace(made, file=file, scenes={AS_IS: _as_is(file)}, default_scene=AS_IS)


def entry_of_function(function: Callable[..., Mechanism], name: str | None = None, guard: Guard = plainly) -> Entry:
    """An entry for a user's function: its keyword arguments are the parameters. A default gives the kind of a parameter, and
    `ml.parameter(0.1, "m", "length", low=0)` as a default also its unit, meaning and limits.

    Raises MechlabError when an argument has no default.
    """
    fields: list[tuple[str, type, Any]] = []
    for key, argument in inspect.signature(function).parameters.items():
        declared = argument.default
        default = declared.default if isinstance(declared, Field) else declared
        if default is argument.empty or default is MISSING or argument.kind in (argument.VAR_KEYWORD, argument.VAR_POSITIONAL):
            raise MechlabError(
                f"{function.__name__}: argument {key!r} needs a default value; it becomes a parameter of the mechanism."
            )
        metadata = declared.metadata if isinstance(declared, Field) else {"any_unit": True}
        fields.append((key, _kind(default), field(default=default, metadata=dict(metadata))))
    cls = make_dataclass(f"{function.__name__}_parameters", fields, frozen=True)

    def build(p: Any, fidelity: str) -> Mechanism:
        return _mechanism(guard(lambda: function(**asdict(p))), f"{function.__name__}()", p)

    return _entry(name or function.__name__, cls, build, _first_line(function), getattr(function, SCENES, {}), guard)


def entry_of_class(cls: type[Any], name: str | None = None, guard: Guard = plainly) -> Entry:
    """An entry for a user's class of parameters: a frozen dataclass with a method `build(self) -> Mechanism` and, if it likes,
    methods under `@ml.scene`. Raises MechlabError for a class that is none."""
    if not is_dataclass(cls) or not callable(getattr(cls, "build", None)):
        raise MechlabError(
            f"{cls.__name__}: a class of parameters is a dataclass (@dataclass(frozen=True)) with a method build(self) that returns "
            "a Mechanism."
        )

    def build(p: Any, fidelity: str) -> Mechanism:
        return _mechanism(guard(p.build), f"{cls.__name__}.build()", p)

    declared = {declared_scene(f).name: f for f in vars(cls).values() if is_scene(f)}
    return _entry(name or cls.__name__.lower(), cls, build, _first_line(cls), declared, guard)


def _mechanism(made: object, what: str, parameters: Any) -> Mechanism:
    if not isinstance(made, Mechanism):
        raise MechlabError(
            f"{what} returned {type(made).__name__}, expected a Mechanism: "
            "end it with `return b.build()` or `return b.assemble(guess)`."
        )
    refuse_parameters(made, [f.name for f in dataclass_fields(parameters)])
    return made


def _first_line(of: object) -> str:
    text = inspect.getdoc(of) or ""
    made_by_dataclass = isinstance(of, type) and text.startswith(f"{of.__name__}(")
    return "" if made_by_dataclass else text.split("\n")[0]


def _kind(default: object) -> type:
    if isinstance(default, tuple):
        return tuple[int, ...] if all(isinstance(x, int) for x in default) else tuple[float, ...]
    for kind in (Fraction, str):
        if isinstance(default, kind):
            return kind
    return float


# -- scenes --------------------------------------------------------------------------------------------------------------

SCENE, SCENES = "_mechlab_scene", "_mechlab_scenes"
"""Attributes: of a function that declares a scene, its DeclaredScene; of a function that makes a mechanism, its scenes by name."""


@dataclass(frozen=True)
class DeclaredScene:
    """What `scene` knows of a function that makes a scene."""

    name: str
    default: bool
    parameters: Mapping[str, Any]


def is_scene(made: object) -> bool:
    """Whether `scene` has decorated it."""
    return hasattr(made, SCENE)


def declared_scene(made: object) -> DeclaredScene:
    """What `scene` noted of a function."""
    found: DeclaredScene = getattr(made, SCENE)
    return found


M = TypeVar("M", bound=Callable[..., Scene])


@overload
def scene(function: M, /) -> M: ...
@overload
def scene(
    *, of: Callable[..., Mechanism] | None = None, name: str | None = None, default: bool = False, **parameters: object
) -> Callable[[M], M]: ...
@explained
def scene(
    function: M | None = None,
    /,
    *,
    of: Callable[..., Mechanism] | None = None,
    name: str | None = None,
    default: bool = False,
    **parameters: object,
) -> M | Callable[[M], M]:
    """Decorator: the function or method declares a scene; it takes the parameters and returns a Scene.

    of: the user's function whose mechanism it is a scene of (not for methods of a class of parameters). name: default the name of
    the function with "-" for "_". default: this scene is run when none is named. Other keywords: values of parameters in this scene,
    which those of the user replace. Its docstring says what happens in it. Raises MechlabError for a name that is taken.
    """

    def declare(made: M) -> M:
        called = name or made.__name__.replace("_", "-")
        if called in (HOLD, FREE):
            raise MechlabError(f"scene {called!r}: every mechanism has a scene of this name; take another.")
        setattr(made, SCENE, DeclaredScene(called, default, parameters))
        if of is not None:
            known = vars(of).setdefault(SCENES, {})
            if called in known and known[called].__module__ != made.__module__:
                raise MechlabError(f"scene {called!r} of {of.__name__} is declared twice; rename one of them.")
            known[called] = made
        return made

    return declare if function is None else declare(function)


def _recipe(made: Any, guard: Guard) -> SceneRecipe:
    declared = declared_scene(made)

    def make(p: Any, fidelity: str) -> Scene:
        found = guard(lambda: made(p))
        if not isinstance(found, Scene):
            raise MechlabError(f"scene {declared.name}: {made.__name__}() returned {type(found).__name__}, expected a Scene.")
        return replace(found, fidelity=fidelity)

    return SceneRecipe(make, LEVEL, _first_line(made), declared.parameters)


def holding(mechanism: Mechanism) -> bool:
    """Whether a drive of the mechanism gives a force while nothing is asked of it."""
    return any(drive_law(mechanism, d) is not None for d in mechanism.drives)


def _entry(
    name: str,
    cls: type[Any],
    build: Callable[[Any, str], Mechanism],
    summary: str,
    declared: Mapping[str, Any],
    guard: Guard = plainly,
) -> Entry:
    def hold(p: Any, fidelity: str) -> Scene:
        return Scene(HOLD, fidelity, 2.0, text="the drives hold their targets against weight, springs and loads")

    def free(p: Any, fidelity: str) -> Scene:
        return Scene(
            FREE, fidelity, 2.0, text="the mechanism moves under its own weight from the given initial state",
            drives="free",
        )  # fmt: skip

    chosen = [n for n, f in declared.items() if declared_scene(f).default]
    if len(chosen) > 1:
        raise MechlabError(f"{name}: the scenes {' and '.join(chosen)} are both declared with default=True; choose one.")
    return Entry(
        name=name, title=name, summary=summary, parameters=cls, build=build, fidelities={LEVEL: "as written"},
        default_fidelity=LEVEL, default_scene=chosen[0] if chosen else HOLD,
        scenes={
            **{n: _recipe(f, guard) for n, f in declared.items()},
            HOLD: SceneRecipe(hold, LEVEL, "gravity, springs and the drives, which hold their targets"),
            FREE: SceneRecipe(free, LEVEL, "moves freely from its initial state, its drives released"),
        },
    )  # fmt: skip
