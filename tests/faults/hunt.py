"""Drawing faults from a seed, and looking whether the checks of their mechanism catch them."""

from __future__ import annotations

import functools
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab import catalog
from mechlab.engines.pinocchio import model as pin_models
from mechlab.errors import EngineMissing, MechlabError
from mechlab.experiment.entry import Check
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.kit import planar_entry
from mechlab.lab.design import Design, design
from mechlab.studies.check.check import checks_of
from tests.faults import builders, formulas, writers
from tests.faults.marks import marks
from tests.faults.patch import replaced

FAMILIES = ("builder", "MJCF writer", "Pinocchio writer", "closed form")
SHARES = (0.45, 0.15, 0.1, 0.3)
KINDS = ("sign", "frame", "tooth", "inertia", "row", "unit")
LIMIT = 20.0
"""Seconds of CPU that a check with a fault in it may take: solvers that no longer converge take long."""


ENDLESS = "no end"


@dataclass(frozen=True)
class Fault:
    """One error: where it is, of what kind, in words; `target` is replaced by `make(target)`. `wrapper` of a closed form
    tells whether a call came out differently."""

    seed: int
    mechanism: str
    family: str
    kind: str
    text: str
    target: Any
    make: Callable[[Any], Any]
    wrapper: formulas.FormulaFault | None = None
    refused: str = ""


@dataclass(frozen=True)
class Verdict:
    """What became of a fault: `by` the check that caught it; "" escaped; "no-op" it changed nothing; "undecided" a check
    did not come to an end and no other failed."""

    fault: Fault
    by: str
    seconds: float

    @property
    def caught(self) -> bool:
        """Whether it was seen."""
        return self.by not in ("", "no-op", "undecided")


def draw(seed: int, mechanism: str) -> Fault:
    """The fault of a seed: drawn again until it changes the mathematical object."""
    rng = np.random.default_rng(seed)
    d = design(catalog.entry(mechanism), {})
    for _ in range(400):
        family, kind = str(rng.choice(FAMILIES, p=SHARES)), str(rng.choice(KINDS))
        found = _draw(rng, seed, d, family, kind)
        if found is not None:
            return found
    raise AssertionError(f"no fault of {mechanism} for seed {seed}")


def _draw(rng: builders.Rng, seed: int, d: Design, family: str, kind: str) -> Fault | None:
    name, entry = d.name, d.entry
    level = str(rng.choice([f for f in entry.fidelities if f != "kinematic"]))
    m = entry.build(d.parameters, level)
    if family == "builder":
        made = builders.one(rng, builders.FAULTS[kind])(rng, m)
        if made is None:
            return None
        text, alter = made
        try:
            if not builders.differ(marks(m), marks(alter(m))):
                return None
            refused = ""
        except MechlabError as error:
            refused = str(error)
        target = _builder(entry)
        return Fault(
            seed, name, family, kind, f"{level}: {text}", target, lambda f: _altered(f, alter), refused=refused
        )
    if family == "MJCF writer":
        right = to_mjcf(m)
        found = writers.mjcf_fault(rng, kind, right)
        if found is None:
            return None
        text, change = found
        try:
            if not builders.differ(writers.text_marks(right), writers.text_marks(change(right))):
                return None
        except ValueError:
            pass  # the engine refuses it: seen
        return Fault(
            seed, name, family, kind, f"{level}: {text}", to_mjcf, lambda f: lambda *a, **k: change(f(*a, **k))
        )
    if family == "Pinocchio writer":
        if kind not in writers.PIN:
            return None
        found_pin = writers.pin_fault(rng, kind, m)
        assert found_pin is not None
        text, spoil = found_pin
        if not builders.differ(writers.pin_marks(pin_models.build(m)), writers.pin_marks(spoil(pin_models.build(m)))):
            return None
        return Fault(seed, name, family, kind, f"{level}: {text}", pin_models.build, lambda f: lambda x: spoil(f(x)))
    if kind not in formulas.CHANGES:
        return None
    formula = formulas.formula_fault(rng, kind, name)
    if formula is None:
        return None
    text, function, wrapper = formula
    return Fault(seed, name, family, kind, text, function, wrapper, wrapper)


def called_formulas(name: str, work: Callable[[], None]) -> set[str]:
    """The closed forms of an entry (full names) that are called while `work` runs."""
    called: set[str] = set()

    def counted(full: str) -> Callable[[Any], Any]:
        def make(f: Any) -> Any:
            @functools.wraps(f)
            def run(*args: Any, **kwargs: Any) -> Any:
                called.add(full)
                return f(*args, **kwargs)

            return run

        return make

    with ExitStack() as stack:
        for full, f in formulas.functions_of(name):
            stack.enter_context(replaced(f, counted(full)))
        work()
    return called


def _builder(entry: Any) -> Any:
    """The function that makes the mechanisms of an entry, wherever it is called from."""
    owner = getattr(entry.build, "__self__", None)
    return planar_entry._built if isinstance(owner, planar_entry.Planar) else entry.build


def _altered(build: Any, alter: Callable[[Any], Any]) -> Callable[..., Any]:
    kept = lru_cache(maxsize=256)(alter)

    def wrong(*args: Any, **kwargs: Any) -> Any:
        return kept(build(*args, **kwargs))

    return wrong


class TooLong(Exception):
    pass


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    def stop(*_: Any) -> None:
        raise TooLong

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def hunt(fault: Fault, order: Callable[[Check], float] = lambda c: float(c.slow)) -> Verdict:
    """Run the checks of the fault's mechanism in the order of their cost, until one does not pass."""
    start = time.perf_counter()
    d = design(catalog.entry(fault.mechanism), {})
    by, endless = "", False
    with replaced(fault.target, fault.make) as places:
        assert places, f"{fault.text}: nothing holds the function"
        for check in sorted(checks_of(d.entry), key=order):
            by = _caught(check, d.parameters)
            if by != ENDLESS:
                if by:
                    break
            else:
                endless, by = True, ""
    if not by and endless:
        by = "undecided"
    if not by and fault.wrapper is not None and fault.wrapper.calls and not fault.wrapper.fired:
        by = "no-op"
    return Verdict(fault, by, time.perf_counter() - start)


def _caught(check: Check, parameters: Any) -> str:
    """What the check says against a fault: its id, with the reason where it did not come to a number; "" if it passes."""
    try:
        with limited(LIMIT):
            return "" if check.run(parameters).passed else check.id
    except EngineMissing:
        return ""
    except MechlabError:
        return f"{check.id} (refused)"
    except TooLong:
        return ENDLESS
    except Exception as error:
        return f"{check.id} ({type(error).__name__})"
