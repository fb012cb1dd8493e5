"""A user's own function as a law, and the laws that a list or a mapping stands for."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import ClassVar

from mechlab.errors import MechlabError
from mechlab.experiment.laws.loads import Constant
from mechlab.experiment.laws.protocol import Law, OnOne, Plant, register
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.model import Mechanism
from mechlab.values import Quantity, in_unit, one_number

LawFunction = Callable[[float, Plant], float]
"""f(t, plant) -> force on one joint or shaft [N m or N]; t [s]; the plant answers `value(name)`, `rate(name)` and more."""
Laws = Sequence[Law] | Mapping[str, LawFunction | float | str]
"""Laws as they may be given: a sequence of laws, or joint or shaft -> function or constant force."""


@register("function")
@dataclass(frozen=True)
class FunctionLaw(OnOne):
    """The force on one joint or shaft by a user's function(t, plant) -> number [N m or N].

    The function is called at every stage of a step, also for times that come again (stages, smaller steps, runs that estimate an
    error): it must depend on its arguments alone. A controller with memory belongs into a session.
    """

    on: str
    function: LawFunction
    kind: ClassVar[str]

    @property
    def name(self) -> str:
        """Name of the function."""
        return getattr(self.function, "__name__", type(self.function).__name__)

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The force that the function gives. Raises MechlabError where it is no number."""
        value = self.function(t, plant)
        try:
            return {self.on: float(value)}
        except (TypeError, ValueError):
            raise MechlabError(
                f"the function {self.name} on {self.on!r} must return one number [N m or N], it returned {value!r} at t = {t:g} s."
            ) from None


def laws_of(laws: Laws) -> tuple[Law, ...]:
    """The laws that are meant. Raises MechlabError for what is neither a law nor, in a mapping, a function or a number."""
    if isinstance(laws, Mapping):
        return tuple(_law_on(on, what) for on, what in laws.items())
    if not isinstance(laws, Sequence) or isinstance(laws, str):  # type: ignore[unreachable]
        raise MechlabError(f"laws: expected a list such as [ml.Motor(...)], or {{joint: function}}, got {laws!r}.")
    for law in laws:
        if isinstance(law, type) or not (
            callable(getattr(law, "force", None)) and callable(getattr(law, "targets", None))
        ):
            what = (
                "a function needs its joint: laws={joint: function}"
                if callable(law)
                else "expected laws such as ml.Motor(...)"
            )
            raise MechlabError(f"laws: {what}, got {law!r}.")
    return tuple(_in_numbers(law) for law in laws)


def _in_numbers(law: Law) -> Law:
    """The law with numbers for what was written as text with a unit, such as `no_load_rate="300rpm"`."""
    names: list[str] = [f.name for f in fields(law) if f.type == "float"] if is_dataclass(law) else []
    texts = {name: getattr(law, name) for name in names if isinstance(getattr(law, name), str)}
    if not texts:
        return law
    what = f"law {law.kind} on {', '.join(law.targets())}"
    numbers = {name: one_number(f"{what}: {name}", text) for name, text in texts.items()}
    made: Law = replace(law, **numbers)  # type: ignore[type-var]
    return made


_FORCE, _ANGLE = ("N m", "N"), ("rad", "rad")
UNITS = {
    "value": _FORCE, "amplitude": _FORCE, "offset": _FORCE, "limit": _FORCE, "feedforward": _FORCE, "stall": _FORCE,
    "frequency": ("rad/s", "rad/s"), "phase": _ANGLE, "no_load_rate": ("rad/s", "m/s"), "at": ("rad", "m"),
    "stiffness": ("N m/rad", "N/m"), "damping": ("N m s/rad", "N s/m"), "coefficient": ("N m s/rad", "N s/m"),
    "power": ("W", "W"), "voltage": ("V", "V"), "resistance": ("ohm", "ohm"), "current": ("A", "A"), "neglected": ("s", "s"),
}
"""Number of a law -> its SI unit where the law acts on an angle, on a length. The others take plain numbers."""


def with_units(law: Law) -> list[str]:
    """Names of the numbers of a law that were written with a unit."""
    names: list[str] = [f.name for f in fields(law)] if is_dataclass(law) else []
    return [n for n in names if isinstance(getattr(law, n), Quantity)]


def check_units(law: Law, m: Mechanism) -> None:
    """Raise MechlabError for a number of the law that was written with a unit which does not fit what the law acts on."""
    shafts = {s.name: any(n in m.slides for n, _ in s.coefficients) for s in m.shafts}
    turns = any(on not in m.slides for on in law.targets())
    slides = any(on in m.slides or shafts.get(on, False) for on in law.targets())  # a shaft over slides may be of either kind
    for name in with_units(law):
        units = [u for u, fits in zip(UNITS.get(name, ("", "")), (turns, slides), strict=True) if fits]
        in_unit(f"{m.name}: law {law.kind} on {', '.join(law.targets())}: {name}", getattr(law, name), *dict.fromkeys(units))


def _law_on(on: str, what: LawFunction | float | str) -> Law:
    if hasattr(what, "targets"):
        raise MechlabError(f"laws: {on!r}: a law names its joint itself; give a list of laws: laws=[{what!r}].")
    if callable(what):
        return FunctionLaw(on, _of_time_and_plant(on, what))
    return Constant(on, one_number(f"laws: {on!r}", what))


def _of_time_and_plant(on: str, function: LawFunction) -> LawFunction:
    """The function; raises MechlabError where it cannot be called with the time and the plant."""
    try:
        takes = inspect.signature(function)
    except (TypeError, ValueError):  # a function of C tells nothing
        return function
    try:
        takes.bind(0.0, None)
    except TypeError:
        name = getattr(function, "__name__", type(function).__name__)
        raise MechlabError(f"laws: {on!r}: {name}{takes} must take the time and the plant, as f(t, plant).") from None
    return function
