"""A Mechanism as JSON and back, complete and exact: what is read equals what was written.

The JSON has the shape of the dataclasses: one key for each field. Exact ratios are texts ("7/5"), sizes of shapes and
coefficients are objects, vectors are lists, quaternions are (w, x, y, z). The reader needs every field that has no
default, and accepts other top-level keys only if they are listed in EXTRA_KEYS.
"""

from __future__ import annotations

import re
import reprlib
import sys
import types
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any, Union, get_args, get_origin, get_type_hints

from mechlab.errors import MechlabError, explained, unknown
from mechlab.formats.json_text import dump, parse
from mechlab.mechanism.model import Mechanism
from mechlab.values import LARGEST_NUMBER

FORMAT = "mechlab.mechanism"
SCHEMA = 1
EXTRA_KEYS = ("urdf",)
"""Top-level keys that other writers add to those of the mechanism."""
_PAIRS = ("coefficients", "size")
_LARGEST = sys.float_info.max
_RATIO = re.compile(r"[+-]?\d{1,400}([/.]\d{1,400})?", re.ASCII)
"""Ratios as text, without an exponent: Fraction would compute 1e999999999 digit by digit."""


@explained
def to_json(mechanism: Mechanism, extra: Mapping[str, object] | None = None) -> str:
    """The mechanism as JSON text that ends with a newline; `extra`: more top-level keys, of EXTRA_KEYS."""
    for key in extra or {}:
        if key not in EXTRA_KEYS:
            raise unknown("extra key of the JSON", key, EXTRA_KEYS)
    return dump({"format": FORMAT, "schema": SCHEMA, **_encode(mechanism), **(extra or {})}) + "\n"


@explained
def from_json(text: str) -> Mechanism:
    """The Mechanism in JSON text.

    Raises MechlabError when it is not JSON, of another format or schema, has unknown or missing keys or values of a
    wrong type (named by their path, as in bodies[3].joints[0].axis), or when the mechanism is not valid.
    """
    data = parse(text, "the mechanism")
    if data.pop("format", None) != FORMAT:
        raise MechlabError(f'this JSON holds no mechanism: expected "format": "{FORMAT}".')
    schema = data.pop("schema", None)
    if schema != SCHEMA:
        raise MechlabError(f"the mechanism has schema {schema!r}; this version of mechlab reads schema {SCHEMA}.")
    for key in EXTRA_KEYS:
        data.pop(key, None)
    mechanism = _decode(Mechanism, data, "")
    assert isinstance(mechanism, Mechanism)
    return mechanism


def _encode(value: Any) -> Any:
    if is_dataclass(value):
        items = {f.name: getattr(value, f.name) for f in fields(value)}
        items = {
            f.name: items[f.name] for f in fields(value) if not f.metadata.get("brief") or items[f.name] != f.default
        }
        return {n: {k: _encode(x) for k, x in v} if n in _PAIRS else _encode(v) for n, v in items.items()}
    if isinstance(value, Fraction):
        return str(value)
    if isinstance(value, tuple | list):
        return [_encode(v) for v in value]
    if isinstance(value, str) or value is None:
        return value
    return float(value)


@lru_cache(maxsize=64)
def _hints(cls: type) -> dict[str, Any]:
    return get_type_hints(cls)


def _decode(hint: Any, value: Any, path: str) -> Any:
    if hint is float and type(value) is float and -LARGEST_NUMBER <= value <= LARGEST_NUMBER:
        return value  # most values of a file
    if get_origin(hint) in (types.UnionType, Union):
        if value is None:
            return None
        hint = next(h for h in get_args(hint) if h is not type(None))
    if is_dataclass(hint):
        assert isinstance(hint, type)
        return _object(hint, value, path)
    if hint is str:
        return _expect(value, str, "a text", path)
    if hint is Fraction:
        return _fraction(value, path)
    if get_origin(hint) is tuple:
        return _tuple(get_args(hint), value, path)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise MechlabError(f"{path}: expected a number, got {_short(value)}.")
    if not -_LARGEST <= value <= _LARGEST:
        raise MechlabError(f"{path}: {_short(value)} is outside the range of a double.")
    if abs(value) > LARGEST_NUMBER:
        raise MechlabError(f"{path}: {_short(value)} is beyond {LARGEST_NUMBER:g}.")
    return float(value)


def _object(cls: type, value: Any, path: str) -> Any:
    _expect(value, dict, "an object", path)
    known: dict[str, Field[Any]] = {f.name: f for f in fields(cls)}
    at = f"{path}." if path else ""
    for key in value:
        if key not in known:
            raise unknown(f"{path or 'the mechanism'}: key", key, known)
    given = {}
    for name, f in known.items():
        if name in value:
            given[name] = _decode(_hints(cls)[name], value[name], at + name)
        elif f.default is MISSING and f.default_factory is MISSING:
            raise MechlabError(f"{at}{name} is missing; {path or 'the mechanism'} needs it.")
    try:
        return cls(**given)
    except MechlabError as error:
        raise MechlabError(f"{path}: {error}" if path else str(error)) from None


def _tuple(items: tuple[Any, ...], value: Any, path: str) -> tuple[Any, ...]:
    if len(items) == 2 and items[1] is Ellipsis:
        if get_origin(items[0]) is tuple and get_args(items[0])[0] is str:
            return _pairs(get_args(items[0])[1], value, path)
        _expect(value, list, "a list", path)
        return tuple(_decode(items[0], v, f"{path}[{k}]") for k, v in enumerate(value))
    _expect(value, list, "a list", path)
    if len(value) != len(items):
        raise MechlabError(f"{path}: expected {len(items)} numbers, got {len(value)}.")
    return tuple(_decode(h, v, f"{path}[{k}]") for k, (h, v) in enumerate(zip(items, value, strict=True)))


def _pairs(hint: Any, value: Any, path: str) -> tuple[tuple[str, Any], ...]:
    _expect(value, dict, "an object", path)
    return tuple((k, _decode(hint, v, f"{path}.{k}")) for k, v in value.items())


def _fraction(value: Any, path: str) -> Fraction:
    _expect(value, str, 'an exact ratio as text, such as "7/5"', path)
    try:
        if _RATIO.fullmatch(value) is None:
            raise ValueError
        return Fraction(value)
    except (ValueError, ZeroDivisionError):
        raise MechlabError(f'{path}: expected an exact ratio such as "7/5", got {_short(value)}.') from None


def _expect(value: Any, kind: type, words: str, path: str) -> Any:
    if not isinstance(value, kind):
        raise MechlabError(f"{path or 'the mechanism'}: expected {words}, got {_short(value)}.")
    return value


def _short(value: Any) -> str:
    """A value as text of at most 80 characters for a message, however long or deep it is."""
    text = reprlib.repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
