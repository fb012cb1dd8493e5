"""Strangers' files before MuJoCo's compiler in this process: a child process compiles them first.

The compiler is C++: a file that makes it overrun its stack, take all memory or run without end would take this process along. So
each file is compiled once in a process with limits of time and memory (`compile_child`), 10 ms and the time of compiling. What was
taken there may be compiled here. The verdict holds for the same bytes at the same place, as long as this process lives.
"""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import mujoco

from mechlab.engines.mujoco.control import compiling
from mechlab.engines.mujoco.model_file import compile_child
from mechlab.errors import MechlabError
from mechlab.formats.model_text import refuse_far_files

WALL = 60.0
"""Largest wall time of the child [s]: its CPU time is limited, too, but a shared machine may be slow."""


class ModelRefused(MechlabError):
    """MuJoCo does not take the file; the message has its words."""


class ModelCrashed(ModelRefused):
    """MuJoCo crashes with the file, does not end, or takes too much memory; the message says which."""


_verdicts: dict[str, ModelRefused | None] = {}


def guard(source: Path | str) -> None:
    """Compile a file (a Path), or a text, in a child process, unless that was done before.

    Raises ModelRefused with MuJoCo's words, ModelCrashed when the child dies or goes beyond its limits; OSError for a file that
    cannot be read. Before that the file and its includes are checked: MechlabError for faults and for files far from the model.
    """
    text = b"" if isinstance(source, Path) else source.encode("utf-8", "replace")
    place = os.path.abspath(source) if isinstance(source, Path) else "-"
    content = source.read_bytes() if isinstance(source, Path) else text
    key = hashlib.sha256(os.fsencode(place) + b"\0" + content).hexdigest()
    if key not in _verdicts:
        if isinstance(source, Path) and source.suffix.lower() != ".urdf":
            refuse_far_files(source)
        _verdicts[key] = _verdict(place, text)
    refusal = _verdicts[key]
    if refusal is not None:
        raise type(refusal)(str(refusal))


def _verdict(place: str, text: bytes) -> ModelRefused | None:
    library = _library()
    if library is None:  # an installation that keeps the library elsewhere
        return None
    command = [sys.executable, "-S", "-E", "-B", "-P", compile_child.__file__, str(library), mujoco.PLUGINS_DIR, place]
    try:
        found = subprocess.run(command, input=text, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=WALL)
    except subprocess.TimeoutExpired:
        return ModelCrashed(f"MuJoCo does not end compiling it within {WALL:g} s. {_ADVICE}")
    return _ending(found.returncode, " ".join(found.stdout.decode("utf-8", "replace").split()))


_ADVICE = "Look for huge counts and sizes (replicate, composite, textures, height fields, memory), deep nesting, damaged meshes."


def _ending(code: int, words: str) -> ModelRefused | None:
    if code == 0:
        return None
    if code == compile_child.REFUSED:
        return ModelRefused(words)
    if code == compile_child.FATAL:
        return ModelCrashed(f"MuJoCo gives up: {words.rstrip('.')}.")
    if code < 0 and -code in {getattr(signal, "SIGXCPU", None), getattr(signal, "SIGKILL", None)}:
        return ModelCrashed(f"MuJoCo does not end compiling it within {compile_child.CPU} s of CPU time. {_ADVICE}")
    end = f"signal {-code}" if code < 0 else f"exit code {code}"
    limit = f"in a process of its own with {compile_child.MEMORY // 2**30} GiB of memory"
    return ModelCrashed(f"MuJoCo crashes compiling it ({end}), {limit}. {_ADVICE}")


def _library() -> Path | None:
    """The engine's shared library, beside the bindings."""
    folder = Path(mujoco.__file__).parent
    patterns = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    return next((path for pattern in patterns for path in sorted(folder.glob(pattern))), None)


def load_file(path: str | os.PathLike[str]) -> mujoco.MjModel:
    """The model of an MJCF or URDF file.

    Raises ModelRefused with MuJoCo's words when it refuses the file, ModelCrashed (a ModelRefused) when it crashes or does not end.
    """
    file = Path(path)
    try:
        guard(file)
        with compiling():
            return mujoco.MjModel.from_xml_path(str(file))
    except OSError as error:
        raise ModelRefused(f"cannot read {file}: {error.strerror or error}") from None
    except (ValueError, mujoco.FatalError) as error:
        raise ModelRefused(" ".join(str(error).split())) from None


def load_text(text: str) -> mujoco.MjModel:
    """As `load_file`, of the text of a file."""
    try:
        guard(text)
        with compiling():
            return mujoco.MjModel.from_xml_string(text)
    except (ValueError, mujoco.FatalError) as error:
        raise ModelRefused(" ".join(str(error).split())) from None
