"""Replacing one function everywhere it is held, and forgetting what caches know of it."""

from __future__ import annotations

import gc
import sys
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import _lru_cache_wrapper
from typing import Any

from mechlab.engines.pinocchio import model as pin_models


def clear_caches() -> None:
    """Empty every cache of mechlab: a fault must neither meet a result from before it, nor leave one behind."""
    for item in gc.get_objects():
        if isinstance(item, _lru_cache_wrapper) and str(getattr(item, "__module__", "")).startswith("mechlab"):
            item.cache_clear()
    pin_models._KEPT.clear()


@contextmanager
def replaced(target: Any, make: Callable[[Any], Any]) -> Iterator[int]:
    """Within the block, `make(target)` stands wherever a module, an object or a closure of mechlab holds `target`; yields the
    number of places. Caches are cleared before and after."""
    holders = gc.get_referrers(target)
    new = make(target)
    places = _put(holders, target, new)
    try:
        clear_caches()
        yield places
    finally:
        back = _put(holders, new, target)
        clear_caches()
        assert back == places, "a fault was not taken out where it was put in"


def _put(holders: list[Any], old: Any, new: Any) -> int:
    """Put `new` where holders hold `old`; the number of places. (No comprehension: `old` must not be in a cell here.)"""
    places = 0
    for h in holders:
        if isinstance(h, types.CellType):
            if h.cell_contents is old:
                h.cell_contents = new
                places += 1
        elif isinstance(h, dict):
            if _ours(h):
                for key in list(h):
                    if h[key] is old:
                        h[key] = new
                        places += 1
        elif hasattr(h, "__dict__") and not isinstance(h, type) and type(h).__module__.startswith("mechlab"):
            for key in list(vars(h)):
                if vars(h)[key] is old:
                    object.__setattr__(h, key, new)
                    places += 1
    return places


def _ours(namespace: dict[Any, Any]) -> bool:
    """Whether a dict is the namespace of a module or of an object of mechlab."""
    name = namespace.get("__name__")
    if isinstance(name, str):
        return name.startswith("mechlab") and name in sys.modules
    owners = [o for o in gc.get_referrers(namespace) if type(o).__module__.startswith("mechlab")]
    return any(getattr(o, "__dict__", None) is namespace for o in owners)
