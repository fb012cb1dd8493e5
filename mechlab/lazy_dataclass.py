"""`dataclass` of the standard library, whose methods are compiled when the class is first used.

The standard decorator compiles six functions for a frozen class, and a verb imports far more classes than it makes objects of: compiling
them all takes two fifths of `mechlab show` on Python 3.11. Here the class carries stand-ins; the first one that is asked for, or anything
that the standard library looks up on a dataclass, lets the standard decorator do its work. Type checkers see the standard decorator.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from threading import RLock
from typing import TYPE_CHECKING, Any

FIELDS, PARAMS = "__dataclass_fields__", "__dataclass_params__"
LOOKED_UP = (FIELDS, PARAMS, "__match_args__", "__replace__")
"""What the standard decorator leaves on a class for others to find."""
_lock = RLock()


class _Pending:
    """A class that awaits the standard decorator."""

    def __init__(self, cls: type, frozen: bool, eq: bool, repr: bool) -> None:
        self.cls, self.options, self.done = cls, {"frozen": frozen, "eq": eq, "repr": repr}, False
        own = cls.__dict__
        # Python gives a class with an __eq__ of its own the __hash__ None: no choice of its author
        hashed = "__hash__" in own and not (own["__hash__"] is None and "__eq__" in own)
        wanted = {"__init__": True, "__repr__": repr, "__eq__": eq}
        self.methods = {n: _stand_in(self, n) for n, one in wanted.items() if one and n not in own}
        if eq and frozen and not hashed:
            self.methods["__hash__"] = _stand_in(self, "__hash__")
        elif eq and not hashed:
            cls.__hash__ = None  # type: ignore[assignment]
        for name, method in self.methods.items():
            setattr(cls, name, method)
        for name in (*LOOKED_UP, "__signature__"):
            if name not in own:
                setattr(cls, name, _Attribute(self, name))
        if frozen:
            _freeze(cls)

    def complete(self) -> None:
        """Let the standard decorator do its work on a class of the same fields, and take over what it made, one attribute after the
        other: another thread that uses the class finds the stand-in or the method."""
        with _lock:
            if self.done:
                return
            cls = self.cls
            annotations = inspect.get_annotations(cls)
            space = {n: cls.__dict__[n] for n in annotations if n in cls.__dict__}
            if hasattr(cls, "__post_init__"):  # the constructor calls it
                space["__post_init__"] = cls.__post_init__
            space |= {
                "__annotations__": annotations,
                "__module__": cls.__module__,
                "__qualname__": cls.__qualname__,
                "__doc__": "seen by nobody, but without one the decorator writes one",
            }
            bases = [
                type(b.__name__, (), {n: getattr(b, n) for n in (FIELDS, PARAMS)})
                for b in cls.__mro__[1:]
                if FIELDS in vars(b)
            ]
            made: type = dataclasses.dataclass(**self.options)(type(cls.__name__, tuple(bases), space))
            for name, method in self.methods.items():
                method.__wrapped__ = made.__dict__[name]
                if cls.__dict__[name] is method:  # else somebody wrapped the stand-in
                    setattr(cls, name, method.__wrapped__)
            for name in annotations:  # fields become their defaults
                if name in made.__dict__:
                    setattr(cls, name, made.__dict__[name])
                elif name in cls.__dict__:
                    delattr(cls, name)
            for name in LOOKED_UP:
                if name in made.__dict__:
                    setattr(cls, name, made.__dict__[name])
                elif isinstance(cls.__dict__.get(name), _Attribute):
                    delattr(cls, name)
            del cls.__signature__  # type: ignore[attr-defined]
            self.done = True


class _Attribute:
    """Something that others look up on a class. `inspect.signature` finds no __signature__, but a class that is complete."""

    def __init__(self, pending: _Pending, name: str) -> None:
        self.pending, self.name = pending, name

    def __get__(self, instance: object, owner: type) -> Any:
        self.pending.complete()
        return getattr(self.pending.cls, self.name)


def _stand_in(pending: _Pending, name: str) -> Any:
    def method(*args: Any, **keywords: Any) -> Any:
        if not pending.done:  # one that somebody wrapped stays for good
            pending.complete()
        return method.__wrapped__(*args, **keywords)  # type: ignore[attr-defined]

    method.__name__, method.__qualname__ = name, f"{pending.cls.__qualname__}.{name}"
    return method


def _freeze(cls: Any) -> None:
    """Refuse assignments as the standard decorator does: by its error, and not to what subclasses add."""

    def refused(name: str, what: str) -> dataclasses.FrozenInstanceError:
        return dataclasses.FrozenInstanceError(f"cannot {what} field {name!r}")

    def __setattr__(self: Any, name: str, value: Any) -> None:
        if type(self) is cls or name in getattr(cls, FIELDS):
            raise refused(name, "assign to")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:
        if type(self) is cls or name in getattr(cls, FIELDS):
            raise refused(name, "delete")
        super(cls, self).__delattr__(name)

    cls.__setattr__, cls.__delattr__ = __setattr__, __delattr__


def _lazy(cls: type | None = None, /, *, frozen: bool = False, eq: bool = True, repr: bool = True) -> Any:
    """`dataclasses.dataclass` with these three of its options."""

    def decorated(cls: type) -> type:
        defaults = (x.default for x in vars(cls).values() if isinstance(x, dataclasses.Field))
        if any(x is not dataclasses.MISSING for x in defaults):
            # its attributes must be the defaults at once
            return dataclasses.dataclass(frozen=frozen, eq=eq, repr=repr)(cls)
        _Pending(cls, frozen, eq, repr)
        return cls

    return decorated if cls is None else decorated(cls)


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:
    dataclass: Callable[..., Any] = _lazy
