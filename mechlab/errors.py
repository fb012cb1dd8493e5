"""One family of errors. A message names the culprit, what was expected, what exists, and what to try next."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class MechlabError(Exception):
    """Bad input: the base class of every error that mechlab raises on purpose (exit code 1)."""

    exit_code = 1


class UsageError(MechlabError):
    """The command line itself is wrong (exit code 2)."""

    exit_code = 2


class Untrustworthy(MechlabError):
    """The work finished, but its result must not be trusted (exit code 3)."""

    exit_code = 3


class NoSolution(MechlabError):
    """The question has no answer: out of reach, no assembly, no such regime (exit code 4)."""

    exit_code = 4


class EngineMissing(MechlabError):
    """An optional engine is not installed; the message says how to get it."""


def unknown(what: str, name: object, existing: Iterable[str], error: type[MechlabError] = MechlabError) -> MechlabError:
    """An error for a name that does not exist: it lists what exists and guesses what was meant."""
    names = sorted(existing)
    close = get_close_matches(str(name), names, n=1)
    guess = f" Did you mean {close[0]!r}?" if close else ""
    listing = ", ".join(names) if names else "none"
    return error(f"{what} {name!r} does not exist.{guess} Existing: {listing}.")
