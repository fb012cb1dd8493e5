"""One family of errors. A message names the culprit, what was expected, what exists, and what to try next."""

from __future__ import annotations

import traceback
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

DISTRIBUTION = "mechanism-lab"
"""The name of mechlab on the package index, where `mechlab` is another library; import and command are `mechlab`."""
USER_MODULE = "mechlab_user_"
"""Prefix of the names of modules that are made from users' files."""


class MechlabError(Exception):
    """Bad input: the base class of every error that mechlab raises on purpose (exit code 1)."""

    exit_code = 1
    unknown = ""
    """The name that does not exist, of an error made by `unknown`."""


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


def install_extra(extra: str) -> str:
    """The command that installs mechlab with an optional part of its dependencies."""
    return f"pip install '{DISTRIBUTION}[{extra}]'"


def unknown(what: str, name: object, existing: Iterable[str], error: type[MechlabError] = MechlabError) -> MechlabError:
    """An error for a name that does not exist: it lists what exists and guesses what was meant."""
    names = sorted(existing)
    close = get_close_matches(str(name), names, n=1)
    guess = f" Did you mean {close[0]!r}?" if close else ""
    listing = ", ".join(names) if names else "none"
    made = error(f"{what} {name!r} does not exist.{guess} Existing: {listing}.")
    made.unknown = str(name)
    return made


def user_fault(error: BaseException) -> str | None:
    """ "FILE, line N: ..." of the last line of a user's file in the traceback of `error`; None where there is none."""
    frames = [
        f for f in traceback.walk_tb(error.__traceback__) if f[0].f_globals.get("__name__", "").startswith(USER_MODULE)
    ]
    if not frames:
        return None
    frame, line = frames[-1]
    return f"{frame.f_code.co_filename}, line {line}: {described(error)}"


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
