"""Errors of a closed form: one output of one function of `mechlab.analytic` has the wrong sign, factor, unit or place, or two
of its arguments are exchanged."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import sys
import types
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from tests.faults.builders import Rng, one

CHANGES: dict[str, tuple[tuple[str, Callable[[Any], Any]], ...]] = {
    "sign": (("other sign", lambda x: -x),),
    "frame": (("permuted", lambda x: np.roll(x, 1, axis=-1)), ("arguments exchanged", lambda x: x)),
    "tooth": (("2 % more", lambda x: 1.02 * x),),
    "inertia": (("twice", lambda x: 2.0 * x),),
    "unit": (("in degrees", lambda x: x * (180.0 / np.pi)), ("in mm", lambda x: x * 1e3)),
}
"""Kind -> (words, change)."""
LEFT_OUT = ("claims", "portraits", "figure", "looks", "toolpath", "problems")
"""Modules of an entry that no witness of a question or check is in."""


def functions_of(name: str) -> list[tuple[str, Any]]:
    """(full name, function) of mechlab.analytic that the modules of an entry name."""
    prefix = f"mechlab.catalog.{name}"
    found: dict[str, Any] = {}
    for module_name in sorted(n for n in sys.modules if n == prefix or n.startswith(f"{prefix}.")):
        module = sys.modules[module_name]
        if any(part in module_name for part in LEFT_OUT):
            continue
        used = _names_used(module)
        for key, value in vars(module).items():
            if key not in used:
                continue
            if isinstance(value, types.ModuleType) and value.__name__.startswith("mechlab.analytic"):
                found |= {_full(f): f for n, f in vars(value).items() if n in used and _is_formula(f)}
            elif _is_formula(value):
                found[_full(value)] = value
    return sorted(found.items())


def _full(f: Any) -> str:
    return f"{f.__module__.removeprefix('mechlab.analytic.')}.{f.__qualname__}"


def _is_formula(f: Any) -> bool:
    plain = isinstance(f, types.FunctionType | functools._lru_cache_wrapper)
    return plain and str(f.__module__).startswith("mechlab.analytic") and not f.__name__.startswith("_")


def _names_used(module: types.ModuleType) -> set[str]:
    """Every name that the code of a module's own functions and classes mentions."""
    out: set[str] = set()

    def walk(code: types.CodeType) -> None:
        out.update(code.co_names)
        for c in code.co_consts:
            if isinstance(c, types.CodeType):
                walk(c)

    source = inspect.getsource(module)
    walk(compile(source, module.__name__, "exec"))
    return out


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of the numbers and float arrays in a result; an array in 1 to 12 columns counts once for each, too."""
    if isinstance(value, bool | np.bool_ | str | bytes) or value is None:
        return
    if isinstance(value, int | float | np.floating) or (isinstance(value, np.ndarray) and value.dtype.kind == "f"):
        yield path
    elif isinstance(value, dict):
        for k, v in value.items():
            yield from leaves(v, (*path, k))
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for f in dataclasses.fields(value):
            yield from leaves(getattr(value, f.name), (*path, f.name))
    elif isinstance(value, list | tuple):
        for k, v in enumerate(value):
            yield from leaves(v, (*path, k))


def changed(value: Any, path: tuple[Any, ...], change: Callable[[Any], Any]) -> Any:
    """A copy of a result with the leaf at a path changed; as it is where it has no such leaf."""
    if not path:
        return type(value)(change(value)) if isinstance(value, np.floating | float) else change(value)
    head, rest = path[0], path[1:]
    if isinstance(value, dict):
        return {**value, head: changed(value[head], rest, change)} if head in value else value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.replace(value, **{head: changed(getattr(value, head), rest, change)})
    if isinstance(value, list | tuple) and isinstance(head, int) and head < len(value):
        items = [changed(x, rest, change) if k == head else x for k, x in enumerate(value)]
        return type(value)(*items) if hasattr(value, "_fields") else type(value)(items)
    return value


class FormulaFault:
    """A wrapper for a function; `fired` tells whether a call gave another result than the right one."""

    def __init__(self, seed: int, kind: str, words: str, change: Callable[[Any], Any]) -> None:
        self.seed, self.kind, self.words, self.change = seed, kind, words, change
        self.path: tuple[Any, ...] | None = None
        self.fired = False
        self.calls = 0

    def __call__(self, target: Any) -> Any:
        """The wrong function."""

        @functools.wraps(target)
        def wrong(*args: Any, **kwargs: Any) -> Any:
            self.calls += 1
            right = target(*args, **kwargs)
            if self.words == "arguments exchanged":
                other = list(args)
                numbers = [
                    k for k, a in enumerate(args) if isinstance(a, float | int | np.ndarray) and not isinstance(a, bool)
                ]
                if len(numbers) < 2:
                    return right
                a, b = numbers[:2]
                other[a], other[b] = other[b], other[a]
                out = target(*other, **kwargs)
            else:
                if self.path is None:
                    paths = list(leaves(right))
                    if not paths:
                        return right
                    self.path = one(np.random.default_rng(self.seed), paths)
                out = changed(right, self.path, self.change)
            self.fired |= not same(right, out)
            return out

        return wrong


def same(a: Any, b: Any) -> bool:
    """Whether two results are the same to nine digits."""
    for path in leaves(a):
        x, y = np.asarray(_at(a, path), dtype=float), np.asarray(_at(b, path), dtype=float)
        if x.shape != y.shape or not np.allclose(x, y, rtol=1e-9, atol=1e-12, equal_nan=True):
            return False
    return True


def _at(value: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        value = getattr(value, key) if isinstance(key, str) and not isinstance(value, dict) else value[key]
    return value


def formula_fault(rng: Rng, kind: str, name: str) -> tuple[str, Any, FormulaFault] | None:
    """A fault of a closed form of an entry: words, the function, its wrapper."""
    found = one(rng, functions_of(name))
    if found is None:
        return None
    words, change = one(rng, CHANGES[kind])
    fault = FormulaFault(int(rng.integers(2**31)), kind, words, change)
    return f"closed form {found[0]}: {words}", found[1], fault
