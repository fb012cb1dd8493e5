"""Recordings as .npz: arrays, and a JSON header with mechanism, settings, health, units and versions.

Nothing in a file is trusted: it is read only as far as its header explains its size, and every value is checked.
"""

from __future__ import annotations

import io
import json
import math
import types
import zipfile
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, fields
from pathlib import Path
from typing import IO, Any, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.recording import SEVERITIES, Cost, Finding, Health, Recording
from mechlab.experiment.scene import Settings
from mechlab.files import unfinished
from mechlab.formats.json_text import parse
from mechlab.formats.mechanism_json import from_json, to_json
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.results import save_result

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


MOST_BYTES = 2**31
"""Default limit of `load_recording` for the bytes of numbers in a file."""
MOST_HEADER = 2**26  # bytes
CHUNK = 2**16
"""Number of times that are read and checked at once."""
NAMES = ("header", "t", "q", "v", "channels")


@save_result.register
def save_recording(recording: Recording, path: str | Path) -> Path:
    """Write a recording to `path`, whole or not at all; raises CannotWrite when that is not possible."""
    path = Path(path)
    header = {
        "schema": SCHEMA, **{name: getattr(recording, name) for name in TEXTS},
        "parameters": recording.parameters, "settings": asdict(recording.settings), "versions": recording.versions,
        "cost": asdict(recording.cost), "units": recording.units, "errors": recording.errors, "channels": list(recording.channels),
        "health": [f.to_dict() for f in recording.health.findings],
        "mechanism": json.loads(to_json(recording.mechanism)),
    }  # fmt: skip
    arrays = {"t": recording.t, "q": recording.q, "v": recording.v}
    arrays["channels"] = np.array([recording.channels[k] for k in recording.channels]).reshape(
        len(recording.channels), len(recording.t)
    )
    numbers = {name: np.ascontiguousarray(values, dtype=np.float64) for name, values in arrays.items()}
    write_npz(path, json.dumps(header, default=_plain), numbers)
    return path


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)


def write_npz(path: Path, header: str, arrays: Mapping[str, Array]) -> None:
    """An .npz that is the same byte for byte for the same content, written whole or not at all."""
    with unfinished(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in {"header": np.array(header), **arrays}.items():
            buffer = io.BytesIO()
            np.lib.format.write_array(buffer, np.asarray(array), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), buffer.getvalue(), zipfile.ZIP_DEFLATED)


def load_recording(path: str | Path, most_bytes: float = MOST_BYTES) -> Recording:
    """Read a recording with at most `most_bytes` bytes of numbers.

    Raises MechlabError, which names the file and what is wrong with it, for anything that `save_recording` would not write:
    another schema, missing or wrong fields, times that do not increase, arrays of another shape, values of q and v that are
    not finite although the health record does not say so, a mechanism that is not valid, a damaged or oversized file.
    """
    try:
        with open(path, "rb") as file, zipfile.ZipFile(file) as archive:
            return _read(archive, most_bytes)
    except MechlabError as error:
        raise MechlabError(f"{path} is not a recording of mechlab: {error}") from None
    except OSError as error:
        raise MechlabError(f"{path} is not a recording of mechlab: {error.strerror or error}.") from None
    except Exception as error:  # whatever a damaged file makes the readers of zip and npy raise
        words = " ".join(str(error).split())[:200] or type(error).__name__
        raise MechlabError(f"{path} is not a recording of mechlab: {words}.") from None


def _read(archive: zipfile.ZipFile, most_bytes: float) -> Recording:
    entries = _entries(archive)
    if entries["header"].file_size > MOST_HEADER:
        raise MechlabError(f"its header has {entries['header'].file_size} bytes, the limit is {MOST_HEADER}.")
    with archive.open(entries["header"]) as stream:
        text = np.lib.format.read_array(stream, allow_pickle=False)
    if text.dtype.kind != "U" or text.ndim:
        raise MechlabError("its header is not a text.")
    header = read_header(str(text))
    m = header.mechanism
    n = _samples(archive, entries["t"])
    shapes = {"t": (n,), "q": (n, m.nq), "v": (n, m.nv), "channels": (len(header.channels), n)}
    wanted = 8 * sum(int(np.prod(shape, dtype=object)) for shape in shapes.values())
    if wanted > most_bytes:
        raise MechlabError(f"it has {wanted} bytes of numbers, the limit is {most_bytes:.0f}; most_bytes= raises it.")
    with archive.open(entries["t"]) as stream:
        _check_times(stream, n)
    arrays = {name: _numbers(archive, entries[name], name, shape) for name, shape in shapes.items()}
    _check_states(arrays, header)
    return Recording(
        mechanism=m, t=arrays["t"], q=arrays["q"], v=arrays["v"],
        channels=dict(zip(header.channels, arrays["channels"], strict=True)), **header.fields,
    )  # fmt: skip


def _entries(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    found: dict[str, zipfile.ZipInfo] = {}
    for entry in archive.infolist():
        name = entry.filename.removesuffix(".npy")
        if name in found:
            raise MechlabError(f"it holds {entry.filename} twice.")
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise MechlabError(f"{entry.filename} is compressed in a way that recordings are not.")
        found[name] = entry
    missing = [name for name in NAMES if name not in found]
    if missing:
        raise MechlabError(f"{', '.join(missing)} missing; a recording holds {', '.join(NAMES)}.")
    return found


def _head(stream: IO[bytes], name: str) -> tuple[int, ...]:
    """The shape that the head of an .npy states; raises MechlabError unless it holds doubles, row by row."""
    version = np.lib.format.read_magic(stream)
    if version != (1, 0):
        raise MechlabError(f"{name}: expected version 1.0 of .npy, got {version}.")
    shape, by_columns, kind = np.lib.format.read_array_header_1_0(stream)
    if kind != np.dtype("<f8"):
        raise MechlabError(f"{name}: expected doubles (<f8), got {kind}.")
    if by_columns and len(shape) > 1:
        raise MechlabError(f"{name}: expected numbers row by row, got them by columns.")
    return tuple(int(x) for x in shape)


def _samples(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> int:
    """Number of times by the head of t. Raises MechlabError unless the size of the entry agrees."""
    with archive.open(entry) as stream:
        shape = _head(stream, "t")
        if len(shape) != 1 or shape[0] < 1:
            raise MechlabError(f"t: expected the shape (n,) with n >= 1, got {shape}.")
        _check_size(entry, stream.tell(), shape)
    return shape[0]


def _check_size(entry: zipfile.ZipInfo, head: int, shape: tuple[int, ...]) -> None:
    size = head + 8 * int(np.prod(shape, dtype=object))
    if entry.file_size != size:
        raise MechlabError(f"{entry.filename} has {entry.file_size} bytes, its shape {shape} takes {size}.")


def _check_times(stream: IO[bytes], n: int) -> None:
    """Raise MechlabError unless times are finite and increase. Read in pieces: a file of zeros fails early."""
    _head(stream, "t")
    last = -np.inf
    for start in range(0, n, CHUNK):
        piece = np.frombuffer(stream.read(8 * min(CHUNK, n - start)), dtype="<f8")
        times = np.concatenate([[last], piece])
        if not np.all(np.isfinite(piece)):
            raise MechlabError("t: expected finite times.")
        if np.any(times[1:] <= times[:-1]):
            raise MechlabError("t: expected times that increase strictly.")
        last = times[-1]


def _numbers(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, name: str, shape: tuple[int, ...]) -> Array:
    with archive.open(entry) as stream:
        stated = _head(stream, name)
        if stated != shape:
            raise MechlabError(f"{name}: expected the shape {shape}, got {stated}.")
        _check_size(entry, stream.tell(), shape)
        values = np.frombuffer(stream.read(entry.file_size), dtype="<f8")
        return values.reshape(shape).astype(np.float64)


def _check_states(arrays: Mapping[str, Array], header: Header) -> None:
    """Raise MechlabError unless q and v are finite, or the health record says that the run blew up."""
    if header.blown_up:
        return
    for name in ("q", "v"):
        if not np.all(np.isfinite(arrays[name])):
            raise MechlabError(f"{name}: not all values are finite, but the health record does not say so.")
