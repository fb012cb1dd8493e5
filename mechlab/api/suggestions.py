"""Options that are spelled wrong arrive as keys, which are free: the message on a key that does not exist asks for the option."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from typing import ParamSpec, TypeVar

from mechlab.algebra_threads import one_algebra_thread
from mechlab.errors import MechlabError, nearest

P = ParamSpec("P")
R = TypeVar("R")


def suggesting(verb: Callable[P, R]) -> Callable[P, R]:
    """The verb; where it raises for a key that does not exist and an option of the verb is called almost so, the message asks for it."""
    options = [n for n, x in inspect.signature(verb).parameters.items() if x.kind is x.KEYWORD_ONLY]

    @wraps(verb)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            with one_algebra_thread():
                return verb(*args, **kwargs)
        except MechlabError as error:
            written = args[1] if len(args) > 1 and isinstance(args[1], Mapping) else {}  # key=value of the command line
            keys = {*kwargs, *written}
            # a word in place of a number is refused before it is asked whether the key exists
            key = error.unknown if error.unknown in keys else next((k for k in keys if str(error).startswith(f"{k}: ")), "")
            near = nearest(key, options, cutoff=0.75)
            if not near or (near == key and key not in written):  # the option itself, with a value that does not fit
                raise
            option = f"--{near.replace('_', '-')}" if key in written else repr(near)
            hint, (before, listed, after) = f" Did you mean the option {option}?", str(error).partition(" Existing:")
            raise type(error)(before + hint + listed + after) from None

    return call
