"""What every verb shares on the way out: one JSON document or a text on stdout, one message on stderr."""

from __future__ import annotations

import contextlib
import math
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab.cli.terminal import fitted, width_of_stdout
from mechlab.errors import DISTRIBUTION, LeftOutWarning, MechlabError
from mechlab.values import Range, Written

if TYPE_CHECKING:
    from mechlab.experiment.model_file import ModelFile

SCHEMA = 1
PACKAGES = ("numpy", "scipy", "mujoco", "pin")


def envelope(verb: str, names: list[str], values: Mapping[str, Written]) -> dict[str, Any]:
    """What every JSON document carries. A version that is null belongs to an engine that is not installed."""
    from mechlab.units import SYSTEM

    return {
        "schema": SCHEMA,
        "command": verb,
        "names": names,
        "status": "answered",
        "exit_code": 0,
        "units": SYSTEM,
        "versions": {"mechlab": package_version(DISTRIBUTION)} | {p: package_version(p) for p in PACKAGES},
        "parameters": dict(values),
    }


def encode(document: Mapping[str, Any]) -> str:
    """One JSON document. Floats keep all their digits; what is not finite becomes null."""
    import json

    return json.dumps(_plain(document), indent=2, allow_nan=False, ensure_ascii=False)


def _plain(item: Any) -> Any:
    """`item` as JSON knows it. Arrays and numpy scalars are recognized by their methods, so numpy is not imported."""
    if item is None or isinstance(item, bool | int):
        return item if not isinstance(item, Enum) else _plain(item.value)
    if isinstance(item, float):
        return float(item) if math.isfinite(item) else None
    if isinstance(item, Enum):
        return _plain(item.value)
    if isinstance(item, str):
        return str(item)
    if isinstance(item, Mapping):
        return {str(key): _plain(value) for key, value in item.items()}
    if isinstance(item, list | tuple | set | frozenset):
        return [_plain(value) for value in (sorted(item, key=str) if isinstance(item, set | frozenset) else item)]
    if isinstance(item, Fraction | Range | Path):
        return str(item)
    if hasattr(item, "tolist"):
        return _plain(item.tolist())
    if hasattr(item, "to_dict"):
        return _plain(item.to_dict())
    return str(item)


class CannotPrint(MechlabError):
    """The standard output takes nothing more: a full disk behind it, for example."""


def write(text: str) -> None:
    """`text` to stdout. A reader that has gone away (`mechlab list | head -1`) is no error; raises CannotPrint for the rest."""
    if sys.stdout is None:
        return
    try:
        try:
            print(text, flush=True)
        except UnicodeEncodeError:
            print(text.encode("ascii", "replace").decode(), flush=True)
    except BrokenPipeError:
        _to_nowhere()
    except OSError as error:
        _to_nowhere()
        raise CannotPrint(error.strerror or str(error)) from None


def write_result(text: str) -> None:
    """`text` to stdout; on a terminal its tables fit the width."""
    width = width_of_stdout()
    write(text if width is None else fitted(text, width))


def _to_nowhere() -> None:
    """Send what is left in the buffer to the null device; otherwise Python reports the error again at exit."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def close_stdout() -> None:
    """Called after the document is printed: what a user's file prints when Python ends then goes to stderr."""
    if sys.stdout is not None and sys.stderr is not None:
        with contextlib.suppress(OSError, ValueError):
            os.dup2(sys.stderr.fileno(), sys.stdout.fileno())


def complain(message: str) -> None:
    """The one message on stderr that goes with every exit code other than 0."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError):
            print(f"mechlab: {message}", file=sys.stderr, flush=True)


def stage_printer(as_json: bool) -> Callable[[str], None]:
    """The function that prints the stages of a pipeline: to stdout; with --json to a terminal's stderr, or nowhere."""
    if not as_json:
        return write
    if sys.stderr is not None and sys.stderr.isatty():
        return lambda line: print(line, file=sys.stderr, flush=True)
    return lambda line: None


@contextlib.contextmanager
def stdout_kept_clean() -> Iterator[None]:
    """What engines and users' files print in this block goes to stderr: stdout is for the one document."""
    with contextlib.ExitStack() as stack:
        if sys.stderr is not None:
            stack.enter_context(contextlib.redirect_stdout(sys.stderr))
        with contextlib.suppress(OSError):
            saved = os.dup(1)
            stack.callback(os.close, saved)
            os.dup2(2, 1)  # native code writes to the descriptor, not to sys.stdout
            stack.callback(os.dup2, saved, 1)
        yield


@contextlib.contextmanager
def files_read(found: list[ModelFile]) -> Iterator[None]:
    """Adds to `found` the model files that are loaded in this block and were not read whole, each once; other warnings go their
    usual way."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", LeftOutWarning)
        usual = warnings.showwarning

        def show(message: Warning | str, *rest: Any) -> None:
            if not isinstance(message, LeftOutWarning):
                usual(message, *rest)
            elif message.file.path not in [file.path for file in found]:
                found.append(message.file)

        warnings.showwarning = show  # type: ignore[assignment]
        yield


def reading(files: list[ModelFile]) -> dict[str, Any]:
    """What a JSON document says of files that were not read whole; empty where there are none."""
    if not files:
        return {}
    return {"left_out": [x.to_dict() for f in files for x in f.left_out], "reading": [n for f in files for n in f.notes]}


def package_version(package: str) -> str | None:
    """The installed version of `package`, or None."""
    from importlib import metadata  # 20 ms that --help need not pay

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None
