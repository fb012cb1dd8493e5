"""Files and folders that are written whole or not at all.

Content is written under a temporary name in the folder of its target and then renamed: nobody reads half a file, and of
two writers at once the last one wins. The temporary name holds the writing process: what a killed process has left is
removed by the next one that writes in the same folder. Links are followed; devices and pipes are written directly.
"""

from __future__ import annotations

import errno
import os
import platform
import re
import shutil
import stat
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from mechlab.errors import MechlabError

_LEFTOVER = re.compile(r"\.mechlab-([0-9a-f]{8})-(\d+)-[0-9a-f]{8}\.part(\..*)?")
_DESCRIPTOR = re.compile(r"/(?:dev|proc/self)/(?:fd/(\d+)|std(out)|std(err))")
DAY = 86400.0
"""A temporary file that is untouched for this long [s] counts as a leftover, whichever machine wrote it."""


class CannotWrite(MechlabError):
    """A file or folder that cannot be written: its path, and why."""

    def __init__(self, path: str | os.PathLike[str], reason: str) -> None:
        super().__init__(f"cannot write {path}: {reason}.")
        self.path, self.reason = Path(path), reason


def write(path: str | os.PathLike[str], content: bytes | str) -> Path:
    """Write bytes, or text as UTF-8, whole or not at all; makes missing folders; returns the path.

    Raises CannotWrite, which names the path and the reason.
    """
    try:
        data = content.encode("utf-8") if isinstance(content, str) else content
    except UnicodeEncodeError as error:
        raise CannotWrite(path, f"it would hold {error.object[error.start]!r}, which is no character") from None
    with unfinished(path) as temporary:
        temporary.write_bytes(data)
    return Path(path)


def write_formats(
    what: str, path: Path, stem: str, formats: Sequence[str], write_one: Callable[[Path], object]
) -> dict[str, Path]:
    """Write one file in the format of its suffix, or STEM.SUFFIX in all formats into a folder (a path without suffix).

    what: names the result in the message. Returns format -> path. Raises MechlabError, which lists the formats, for another
    suffix.
    """
    if path.suffix and path.suffix not in formats:
        raise MechlabError(
            f"{what}: cannot write {path.name}; formats: {', '.join(formats)}, or a folder for all of them."
        )
    if path.suffix:
        write_one(path)
        return {path.suffix[1:]: path}
    with whole_folder(path) as stage:
        for suffix in formats:
            write_one(stage / f"{stem}{suffix}")
    return {suffix[1:]: path / f"{stem}{suffix}" for suffix in formats}


@contextmanager
def unfinished(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path to write to, with the suffix of `path`; at the end of the block it becomes `path`. Makes missing folders.

    The mode of a file that is replaced is kept. A device, a pipe or an open descriptor (/dev/stdout) gets the content
    at the end. When the block raises, nothing is left. Raises CannotWrite in the place of OSError.
    """
    made: list[Path] = []
    try:
        special = _special(path)
        target = Path(path) if special else Path(os.path.realpath(path))
        folder = Path(tempfile.gettempdir()) if special else target.parent
        made = _folders(folder)
        tidy(folder)
        kept = None if special else _replaced(target)
        temporary = folder / _name(target.suffix)
        try:
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))  # the umask decides the mode
            yield temporary
            if special:
                _through(path, temporary)
            else:
                if kept is not None:
                    _same_rights(temporary, kept)
                os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        _take_back(made)
        raise CannotWrite(path, _reason(error)) from None
    except BaseException:
        _take_back(made)
        raise


@contextmanager
def whole_folder(out: str | os.PathLike[str]) -> Iterator[Path]:
    """A folder to write into; at the end of the block its files are moved into `out`, which is made where it is missing.

    Other files of `out` stay. When the block raises, or a file cannot be moved, `out` is as it was before. One process
    at a time moves its files. Raises CannotWrite, which names the path as it would be in `out`, in the place of OSError.
    """
    target = Path(os.path.realpath(out))
    try:
        near = next(p for p in (target, *target.parents) if p.exists())
        if not near.is_dir():
            raise CannotWrite(out, f"{near} is a file, expected a folder")
        tidy(near)
        tidy(near.parent)
        stage = near / _name("")
        stage.mkdir()
    except OSError as error:
        raise CannotWrite(out, _reason(error)) from None
    try:
        yield stage
        _publish(stage, target)
    except CannotWrite as error:
        raise CannotWrite(_outside(error.path, stage, Path(out)), error.reason) from None
    except OSError as error:
        named = error.filename if isinstance(error.filename, str) else ""
        raise CannotWrite(_outside(Path(named), stage, Path(out)) if named else out, _reason(error)) from None
    finally:
        shutil.rmtree(stage, ignore_errors=True)


def tidy(folder: Path) -> None:
    """Remove the leftovers of killed processes from a folder: of this machine those whose process has ended, of any
    machine those untouched for a day."""
    with suppress(OSError):
        for name in os.listdir(folder):
            found = _LEFTOVER.fullmatch(name)
            if found is not None and _left(folder / name, found[1], int(found[2])):
                _remove(folder / name)


def _left(path: Path, place: str, process: int) -> bool:
    if place == _place() and os.name != "nt":
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return True
        except (PermissionError, OverflowError):
            pass
    with suppress(OSError):
        inside = path.rglob("*") if path.is_dir() else ()
        return time.time() - max(p.stat().st_mtime for p in (path, *inside)) > DAY
    return False


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink()


def _name(suffix: str) -> str:
    """A name that nobody else uses and that says who writes."""
    kind = suffix if len(suffix) <= 16 else ""
    return f".mechlab-{_place()}-{os.getpid()}-{os.urandom(4).hex()}.part{kind}"


@cache
def _place() -> str:
    """Where a process number means the same process: machine, and on Linux the namespace of processes."""
    namespace = ""
    with suppress(OSError):
        namespace = os.readlink("/proc/self/ns/pid")
    return f"{zlib.crc32(f'{platform.node()} {namespace}'.encode()):08x}"


def _special(path: str | os.PathLike[str]) -> bool:
    """Whether a path is a device, a pipe, a socket, or a descriptor of this process."""
    if _DESCRIPTOR.fullmatch(os.path.abspath(path)):
        return True
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _through(path: str | os.PathLike[str], content: Path) -> None:
    """Copy a file into a device, a pipe or an open descriptor."""
    found = _DESCRIPTOR.fullmatch(os.path.abspath(path))
    if found is None:
        descriptor = os.open(path, os.O_WRONLY)
    else:
        descriptor = os.dup(int(found[1] or (1 if found[2] else 2)))
    with content.open("rb") as source, os.fdopen(descriptor, "wb") as sink:
        shutil.copyfileobj(source, sink)


def _replaced(target: Path) -> os.stat_result | None:
    """The file that will be replaced; raises CannotWrite or PermissionError for one that must not be."""
    try:
        found = target.stat()
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(0, "it is a folder, expected the name of a file")
    if not os.access(target, os.W_OK):
        raise PermissionError(0, "the file is read-only")
    return found


def _same_rights(path: Path, before: os.stat_result) -> None:
    """Give a file the mode and, where that is allowed, the owner of the file that it replaces."""
    with suppress(OSError, AttributeError):
        if (before.st_uid, before.st_gid) != (path.stat().st_uid, path.stat().st_gid):
            os.chown(path, before.st_uid, before.st_gid)
    path.chmod(stat.S_IMODE(before.st_mode))


def _folders(folder: Path) -> list[Path]:
    """Make a folder and what is missing above it; returns what was made, innermost first."""
    way = (folder, *folder.parents)
    blocking = [p for p in way if p.exists() and not p.is_dir()]
    if blocking:
        raise NotADirectoryError(errno.ENOTDIR, f"{blocking[0]} is a file, no folder")
    missing = [p for p in way if not p.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    return missing


def _take_back(made: list[Path]) -> None:
    for folder in made:
        with suppress(OSError):
            folder.rmdir()


def _publish(stage: Path, out: Path) -> None:
    """Move the files of `stage` into `out`; if one cannot be moved, everything is put back."""
    made = _folders(out.parent)
    try:
        if not out.exists():
            with suppress(OSError):  # another process may have made it meanwhile
                stage.rename(out)
                return
            made = [out, *made]
        with _alone(out):
            _merge(stage, out, made)
    except BaseException:
        _take_back(made)
        raise


def _merge(stage: Path, out: Path, made: list[Path]) -> None:
    before = stage / _name(".before")
    before.mkdir()
    moved: list[tuple[Path, Path | None]] = []
    file = stage
    try:
        for file in sorted(p for p in stage.rglob("*") if p.is_file()):
            target = out / file.relative_to(stage)
            made[:0] = _folders(target.parent)
            if _special(target):
                _through(target, file)
                continue
            target = Path(os.path.realpath(target))
            kept = _replaced(target)
            backup = None if kept is None else before / str(len(moved))
            if kept is not None and backup is not None:
                _same_rights(file, kept)
                _second_name(target, backup)
            moved.append((target, backup))
            os.replace(file, target)
    except BaseException as error:
        for changed, old in reversed(moved):
            with suppress(OSError):
                changed.unlink() if old is None else os.replace(old, changed)
        if isinstance(error, OSError):
            raise CannotWrite(file, _reason(error)) from None
        raise


def _second_name(file: Path, other: Path) -> None:
    """A hard link, or a copy where the file system has none."""
    try:
        os.link(file, other)
    except OSError:
        shutil.copy2(file, other)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Wait until no other process moves files into a folder. Where folders cannot be locked, the last file wins."""
    try:
        import fcntl

        folder.mkdir(exist_ok=True)
        lock = os.open(folder, os.O_RDONLY)
    except (ImportError, OSError):
        yield
        return
    try:
        with suppress(OSError):
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


def _outside(path: Path, stage: Path, out: Path) -> Path:
    """A path in the stage as it would be in `out`."""
    return out / path.relative_to(stage) if path.is_relative_to(stage) else path


def _reason(error: OSError) -> str:
    return error.strerror or str(error) or type(error).__name__
