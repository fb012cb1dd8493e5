"""One family of errors. A message names the culprit, what was expected, what exists, and what to try next."""

from __future__ import annotations

import inspect
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from typing import Any, TypeVar

T = TypeVar("T", bound=Callable[..., Any])

DISTRIBUTION = "mechanism-lab"
"""The name of mechlab on the package index, where `mechlab` is another library; import and command are `mechlab`."""
USER_MODULE = "mechlab_user_"
"""Prefix of the names of modules that are made from users' files."""


class MechlabError(Exception):
    """Bad input: the base class of every error that mechlab raises on purpose (exit code 1)."""

    exit_code = 1
    unknown = ""
    """The name that does not exist, of an error made by `unknown`."""


class ArgumentError(MechlabError, TypeError):
    """A class or function was called with arguments that it does not have, or without some that it needs. Python's own error for
    this is a TypeError, so it is one too."""


class UsageError(MechlabError):
    """The command line itself is wrong (exit code 2)."""

    exit_code = 2


class Untrustworthy(MechlabError):
    """The work finished, but its result must not be trusted (exit code 3)."""

    exit_code = 3


class LeftOutWarning(UserWarning):
    """A file was read, but not everything in it; `file`, a `mechlab.experiment.model_file.ModelFile`, says what."""

    def __init__(self, file: Any) -> None:
        super().__init__(f"{file.name}: {'; '.join(file.remarks)}")
        self.file = file


class NoSolution(MechlabError):
    """The question has no answer: out of reach, no assembly, no such regime (exit code 4)."""

    exit_code = 4


class EngineMissing(MechlabError):
    """An optional engine is not installed; the message says how to get it."""


def warn(what: str | Warning, category: type[Warning] = UserWarning) -> None:
    """Warn at the line of the user's code that led here, the first outside mechlab: Python shows a DeprecationWarning only where
    it stands in the user's own script."""
    depth, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "mechlab":
        depth, frame = depth + 1, frame.f_back
    warnings.warn(what, category, stacklevel=depth + 1)


def install_extra(extra: str) -> str:
    """The command that installs mechlab with an optional part of its dependencies."""
    return f"pip install '{DISTRIBUTION}[{extra}]'"


def nearest(name: str, names: Iterable[str], cutoff: float = 0.6) -> str:
    """The name most like `name`, "" where none is."""
    from difflib import get_close_matches

    return next(iter(get_close_matches(name, list(names), n=1, cutoff=cutoff)), "")


def unknown(what: str, name: object, existing: Iterable[str], error: type[MechlabError] = MechlabError) -> MechlabError:
    """An error for a name that does not exist: it lists what exists and guesses what was meant."""
    names = sorted(existing)
    close = nearest(str(name), names)
    guess = f" Did you mean {close!r}?" if close else ""
    listing = ", ".join(names) if names else "none"
    made = error(f"{what} {name!r} does not exist.{guess} Existing: {listing}.")
    made.unknown = str(name)
    return made


def explained(made: T) -> T:
    """The class or function; called with arguments that do not fit it raises ArgumentError, which names them and what exists.

    For every public name. A TypeError from inside the call passes unchanged.
    """
    no_init = isinstance(made, type) and made.__init__ is object.__init__  # type: ignore[misc]
    kind = "__new__" if no_init else "__init__"
    call = getattr(made, kind) if isinstance(made, type) else made
    name = made.__qualname__

    @wraps(call)
    def checked(*args: Any, **keywords: Any) -> Any:
        try:
            return call(*args, **keywords)
        except ArgumentError:
            raise
        except TypeError as error:
            if (wrong := _misfit(name, inspect.signature(call), args, keywords)) is None:
                raise
            raise wrong from error

    if not isinstance(made, type):
        return checked  # type: ignore[return-value]
    setattr(made, kind, staticmethod(checked) if kind == "__new__" else checked)
    return made


def _misfit(name: str, signature: inspect.Signature, args: Sequence[object], keywords: Mapping[str, object]) -> ArgumentError | None:
    """What does not fit a signature: an unknown keyword, too many values, missing ones; None where all fits."""
    try:
        signature.bind(*args, **keywords)
    except TypeError as error:
        every = [p for p in signature.parameters.values() if p.name not in ("self", "cls")]
        given = args[len(signature.parameters) - len(every) :]
        collects = any(p.kind is p.VAR_KEYWORD for p in every)
        own = [p.name for p in every if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
        strange = [k for k in keywords if k not in own]
        if strange and not collects:
            made = unknown(f"{name}: argument", strange[0], own, ArgumentError)
            assert isinstance(made, ArgumentError)
            return made
        needed = [n for n in own if signature.parameters[n].default is inspect.Parameter.empty]
        missing = [n for n in needed if n not in keywords and n not in own[: len(given)]]
        optional = [n for n in own if n not in needed]
        what = f"missing: {', '.join(missing)}" if missing else str(error)
        also = f"; optional: {', '.join(optional)}" if optional else ""
        near = next((f" Did you mean {n!r} by {k!r}?" for k in strange if (n := nearest(k, missing))), "")
        return ArgumentError(f"{name}: {what}. Needed: {', '.join(needed) or 'nothing'}{also}.{near}")
    return None


def user_fault(error: BaseException) -> str | None:
    """ "FILE, line N: ..." of the last line of a user's file in the traceback of `error`; None where there is none."""
    found, step = None, error.__traceback__
    while step is not None:
        if step.tb_frame.f_globals.get("__name__", "").startswith(USER_MODULE):
            found = f"{step.tb_frame.f_code.co_filename}, line {step.tb_lineno}: {described(error)}"
        step = step.tb_next
    return found


def described(error: BaseException) -> str:
    """The kind of an error and its words on one line; a SystemExit is described by its effect."""
    try:
        words = " ".join(str(error).split())
    except Exception:  # a user's own class may fail at this too
        words = ""
    kind = type(error).__name__
    if isinstance(error, SystemExit):
        return f"{kind}{f': {words}' if words else ''}; the file must not end Python. Remove exit() and sys.exit()."
    return f"{kind}: {words}" if words else f"{kind}."
