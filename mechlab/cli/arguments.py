"""What every verb shares on the way in: names, key=value pairs among the options, flags in texts."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from mechlab.errors import MechlabError, UsageError
from mechlab.values import Written, parse_value


def refuse_bytes(arguments: Sequence[str]) -> None:
    """Raise UsageError for an argument whose bytes are not valid text."""
    for argument in arguments:
        try:
            argument.encode("utf-8")
        except UnicodeEncodeError:
            raise UsageError(f"the argument {ascii(argument)} is no UTF-8 text; write it in UTF-8.") from None


def split_tokens(tokens: Sequence[str]) -> tuple[list[str], dict[str, Written]]:
    """Names (no `=`) and values (`key=value`). Raises MechlabError for a key that comes twice."""
    names: list[str] = []
    values: dict[str, Written] = {}
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


def one_name(names: Sequence[str], verb: str, what: str = "NAME", choices: Sequence[str] = ()) -> str:
    """The only name. Raises UsageError, with what to write instead, for none and for several."""
    if len(names) == 1:
        return names[0]
    if choices:
        raise UsageError(f"mechlab {verb} takes one {what}, got {', '.join(names) or 'none'}: {', '.join(choices)}.")
    if not names:
        raise UsageError(f"a NAME is missing: mechlab {verb} NAME. `mechlab list` shows the catalog; "
                         "file.py:function, .json, .xml and .urdf files work too.")  # fmt: skip
    extra = ", ".join(repr(name) for name in names[1:])
    raise UsageError(f"mechlab {verb} takes one NAME, got {names[0]!r} and {extra}. Write quantities as key=value.")


def with_flags(text: str, flags: Mapping[str, str]) -> str:
    """A text of the API for the command line: `max_error` is written --max-error."""
    return re.sub(r"`(\w+)`", lambda word: flags.get(word[1], word[0]), text)
