"""Recordings as .npz: arrays, and a JSON header (`recording_header`).

Nothing in a file is trusted: it is read only as far as its header explains its size, and every value is checked.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import IO

import numpy as np

from mechlab.errors import MechlabError, explained
from mechlab.experiment.recording import Recording
from mechlab.files import unfinished
from mechlab.formats.recording_header import Header, header_text, read_header
from mechlab.mechanism.geometry import Array
from mechlab.results import save_result

MOST_BYTES = 2**31
"""Default limit of `load_recording` for the bytes of numbers in a file."""
MOST_HEADER = 2**26  # bytes
CHUNK = 2**16
"""Number of times that are read and checked at once."""
NAMES = ("header", "t", "q", "v", "channels")


@explained
@save_result.register
def save_recording(recording: Recording, path: str | Path) -> Path:
    """Write a recording to `path`, whole or not at all; raises CannotWrite when that is not possible."""
    path = Path(path)
    arrays = {"t": recording.t, "q": recording.q, "v": recording.v}
    arrays["channels"] = np.array([recording.channels[k] for k in recording.channels]).reshape(
        len(recording.channels), len(recording.t)
    )
    numbers = {name: np.ascontiguousarray(values, dtype=np.float64) for name, values in arrays.items()}
    write_npz(path, header_text(recording), numbers)
    return path


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
