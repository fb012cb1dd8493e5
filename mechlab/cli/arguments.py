"""What every verb shares on the way in: a parser that raises, names, key=value pairs among the options."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import NoReturn

from mechlab.cli.output import write
from mechlab.errors import MechlabError, UsageError
from mechlab.values import Value, parse_value


class Parser(argparse.ArgumentParser):
    """An ArgumentParser that raises UsageError instead of ending the process, so that --json can answer."""

    def error(self, message: str) -> NoReturn:
        """Raise UsageError with the usage line and where to read more."""
        usage = " ".join(self.format_usage().split())
        raise UsageError(f"{message}. {usage[0].upper()}{usage[1:]}. More: {self.prog} --help.")

    def print_help(self, file: object = None) -> None:
        """Print the help as every other answer."""
        write(self.format_help().rstrip())


def refuse_bytes(arguments: Sequence[str]) -> None:
    """Raise UsageError for an argument whose bytes are no text."""
    for argument in arguments:
        try:
            argument.encode("utf-8")
        except UnicodeEncodeError:
            raise UsageError(f"the argument {ascii(argument)} is no UTF-8 text; write it in UTF-8.") from None


def verb_parser(verb: str, positionals: str, summary: str) -> Parser:
    """A parser for one verb: its names and key=value tokens, and the options that every verb has."""
    parser = Parser(
        prog=f"mechlab {verb}",
        usage=f"mechlab {verb} {positionals} [options]".replace("  ", " "),
        description=summary,
        epilog="Numbers are SI; 37deg, 5mm, 300rpm, 17/22, lists a,b,c and ranges lo:hi or lo:hi:n are "
        "understood. Options may stand anywhere among the key=value pairs.",
        allow_abbrev=False,
    )
    parser.add_argument("tokens", nargs="*", metavar="NAME key=value", help=argparse.SUPPRESS)
    parser.add_argument("--json", action="store_true", help="print exactly one JSON document, also on failure")
    return parser


def split_tokens(tokens: Sequence[str]) -> tuple[list[str], dict[str, Value]]:
    """Names (no `=`) and values (`key=value`). Raises MechlabError for a key that comes twice."""
    names: list[str] = []
    values: dict[str, Value] = {}
    for token in tokens:
        key, equals, text = token.partition("=")
        if not equals:
            names.append(token)
        elif not key.strip():
            raise MechlabError(f"{token!r} has no key. Write key=value, without spaces around the equals sign.")
        elif key in values:
            raise MechlabError(f"{key} is given twice: {key}={text} comes after another value. Keep one.")
        else:
            values[key] = parse_value(key, text)
    return names, values


def one_name(names: Sequence[str], verb: str) -> str:
    """The only name. Raises UsageError, with what to write instead, for none and for several."""
    if not names:
        raise UsageError(f"a NAME is missing: mechlab {verb} NAME. `mechlab list` shows the catalog; "
                         "file.py:function, .json, .xml and .urdf files work too.")  # fmt: skip
    if len(names) > 1:
        extra = ", ".join(repr(name) for name in names[1:])
        raise UsageError(f"mechlab {verb} takes one NAME, got {names[0]!r} and {extra}. Write quantities as key=value.")
    return names[0]


def refuse_values(values: dict[str, Value], verb: str) -> None:
    """Raise UsageError for key=value pairs given to a verb that takes none."""
    if values:
        raise UsageError(f"mechlab {verb} takes no key=value, got {', '.join(values)}.")
