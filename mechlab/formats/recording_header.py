"""The JSON header of a recording: mechanism, settings, health, units and versions; every value of a file is checked."""

from __future__ import annotations

import json
import math
import types
from dataclasses import MISSING, asdict, fields, is_dataclass
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.recording import SEVERITIES, Cost, Finding, Health, Recording
from mechlab.experiment.scene import Settings
from mechlab.formats.json_text import parse
from mechlab.formats.mechanism_json import from_json, to_json
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.model import Mechanism

SCHEMA = 1
TEXTS = tuple(name for name, kind in get_type_hints(Recording).items() if kind is str)
"""Fields of a Recording that are texts."""
KEYS = (
    "schema", "name", "scene", "fidelity", "parameters", "settings", "versions", "cost", "units", "channels", "health",
    "mechanism",
)  # fmt: skip
OPTIONAL = ("errors", *(name for name in TEXTS if name not in KEYS))
"""Keys that older files may lack."""

T = TypeVar("T")


@dataclass(frozen=True)
class Header:
    """Contents of a header: the mechanism, the names of the channels, and the other fields of a Recording."""

    mechanism: Mechanism
    channels: tuple[str, ...]
    fields: dict[str, Any]

    @property
    def blown_up(self) -> bool:
        """Whether the health record says that values of the run are not finite."""
        return any(f.name == "finite" and f.severity == "error" for f in self.fields["health"].findings)


def header_text(recording: Recording) -> str:
    """The header of a recording."""
    header = {
        "schema": SCHEMA, **{name: getattr(recording, name) for name in TEXTS},
        "parameters": recording.parameters, "settings": asdict(recording.settings), "versions": recording.versions,
        "cost": asdict(recording.cost), "units": recording.units, "errors": recording.errors, "channels": list(recording.channels),
        "health": [f.to_dict() for f in recording.health.findings],
        "mechanism": json.loads(to_json(recording.mechanism)),
    }  # fmt: skip
    return json.dumps(header, default=_plain)


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)


def read_header(text: str) -> Header:
    """The header in a text; raises MechlabError that names the field."""
    data = parse(text, "its header", finite=False)
    if data.get("schema") != SCHEMA or isinstance(data["schema"], bool | float):
        raise MechlabError(f"schema {data.get('schema')!r}; this version of mechlab reads schema {SCHEMA}.")
    for key in data:
        if key not in KEYS + OPTIONAL:
            raise unknown("key of its header", key, KEYS + OPTIONAL)
    missing = [k for k in KEYS if k not in data]
    if missing:
        raise MechlabError(f"its header lacks {', '.join(missing)}.")
    channels = _names(data["channels"])
    try:
        mechanism = from_json(json.dumps(_table(data, "mechanism")))
    except MechlabError as error:
        raise MechlabError(f"mechanism: {error}") from None
    found: dict[str, Any] = {name: _text(data[name], name) for name in TEXTS if name in data}
    found["parameters"] = _table(data, "parameters")
    found["settings"] = _finite(_made(Settings, data["settings"], "settings"), "settings")
    found["cost"] = _finite(_made(Cost, data["cost"], "cost"), "cost")
    found["units"] = {k: _text(v, f"units: {k}") for k, v in _table(data, "units").items()}
    found["versions"] = {k: v if v is None else _text(v, f"versions: {k}") for k, v in _table(data, "versions").items()}
    found["errors"] = _errors(_table(data, "errors"), channels)
    found["health"] = _health(data["health"])
    return Header(mechanism, channels, found)


def _names(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(x, str) for x in value):
        raise MechlabError("channels: expected a list of names.")
    if len(set(value)) < len(value):
        raise MechlabError("channels: a name is there twice.")
    return tuple(value)


def _table(data: dict[str, Any], key: str) -> dict[str, Any]:
    value = data.get(key, {})
    if not isinstance(value, dict):
        raise MechlabError(f"{key}: expected an object, got {type(value).__name__}.")
    return value


def _text(value: Any, what: str) -> str:
    if not isinstance(value, str):
        raise MechlabError(f"{what}: expected a text, got {type(value).__name__}.")
    return value


def _errors(values: dict[str, Any], channels: tuple[str, ...]) -> dict[str, float]:
    """Channel -> number >= 0, which may be infinite."""
    for name, value in values.items():
        if name not in channels:
            raise unknown("errors: channel", name, channels)
        if not _number(value) or not value >= 0:
            raise MechlabError(f"errors: {name}: expected a number >= 0, got {value!r}.")
    return {name: float(value) for name, value in values.items()}


def _health(value: Any) -> Health:
    if not isinstance(value, list):
        raise MechlabError("health: expected a list of findings.")
    findings = tuple(_made(Finding, item, f"health[{k}]") for k, item in enumerate(value))
    for finding in findings:
        if finding.severity not in SEVERITIES:
            raise unknown(f"health: {finding.name}: severity", finding.severity, SEVERITIES)
    return Health(findings)


def _made(cls: type[T], value: Any, what: str) -> T:
    """A dataclass of texts and numbers from an object with a key for each field."""
    if not isinstance(value, dict):
        raise MechlabError(f"{what}: expected an object, got {type(value).__name__}.")
    hints = get_type_hints(cls)
    for key in value:
        if key not in hints:
            raise unknown(f"{what}: key", key, hints)
    given = {}
    for field in fields(cls):  # type: ignore[arg-type]
        if field.name in value:
            given[field.name] = _field(hints[field.name], value[field.name], f"{what}: {field.name}")
        elif field.default is MISSING and field.default_factory is MISSING:
            raise MechlabError(f"{what}: {field.name} is missing.")
    return cls(**given)


def _finite(made: T, what: str) -> T:
    for name, value in vars(made).items():
        if isinstance(value, float) and not math.isfinite(value):
            raise MechlabError(f"{what}: {name}: expected a finite number, got {value!r}.")
    return made


def _field(hint: Any, value: Any, what: str) -> Any:
    if get_origin(hint) is types.UnionType:
        if value is None:
            return None
        hint = next(h for h in get_args(hint) if h is not type(None))
    if is_dataclass(hint):
        return _finite(_made(hint, value, what), what)  # type: ignore[arg-type]
    if hint is str:
        return _text(value, what)
    if not _number(value) or (hint is int and not isinstance(value, int)):
        raise MechlabError(f"{what}: expected a {'whole ' if hint is int else ''}number, got {type(value).__name__}.")
    return hint(value)


def _number(value: Any) -> bool:
    """True for a number that fits a double; NaN and the infinities are numbers here."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return isinstance(value, float) or math.log2(abs(value) or 1) < 1024
