"""The text of somebody's model file, and the other files that an MJCF names: nothing is read that lies far from the model.

A model may name meshes, textures and includes beside it, below it, or beside the folders above it: `../assets` is usual. It may not
name files by their place on the machine, by way of the root of the file system or the user's home, or behind a URL: a file from
somewhere else would decide what is read here. Links inside the folder are followed: only who unpacks a folder can put them there.
"""

from __future__ import annotations

import os
import stat
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.formats.soundness import sound
from mechlab.formats.xml_text import MOST_CHARACTERS, label

LEVELS = 6
"""Largest number of folders that a path of a model may climb; the deepest public models climb 4."""
MOST_INCLUDES = 1000
FILES = ("file", "fileback", "filedown", "filefront", "fileleft", "fileright", "fileup")
FOLDERS = ("meshdir", "texturedir", "assetdir")


def read_text(path: Path) -> str:
    """The text of an ordinary file of at most MOST_CHARACTERS bytes; raises MechlabError that names the file."""
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode) and not stat.S_ISDIR(found.st_mode):
            raise MechlabError(f"cannot read {path}: it is no ordinary file (a device, a pipe or a socket).")
        if found.st_size > MOST_CHARACTERS:
            raise MechlabError(f"cannot read {path}: it has {found.st_size} bytes, the limit is {MOST_CHARACTERS}.")
        return path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:  # ValueError: no UTF-8, or a path with a zero byte
        raise MechlabError(f"cannot read {path}: {getattr(error, 'strerror', None) or error}.") from None


def refuse_far_files(path: Path) -> None:
    """Check an MJCF and its includes before an engine reads what they name.

    Raises MechlabError for a path that leads too far from the folder of the model or to what is no ordinary file, and for faults
    of an include (`soundness`). Files that are missing are left to the engine.
    """
    home = os.path.dirname(os.path.abspath(path))
    roots = list(_with_includes(Path(os.path.abspath(path)), home))
    settings = [e for root in roots for e in root.iter("compiler")]
    folders = []
    for compiler in settings:
        for key in FOLDERS:
            if folder := compiler.get(key):
                folders.append(_near(home, folder, compiler, key))
    stripped = any(c.get("strippath") == "true" for c in settings)
    for root in roots:
        for element in root.iter():
            for key in FILES:
                name = element.get(key)
                if name and element.tag not in ("include", "model"):
                    for folder in folders or [home]:
                        _near(home, os.path.basename(name) if stripped else os.path.join(folder, name), element, key)
                elif name:
                    _near(home, name, element, key)


def _with_includes(path: Path, home: str) -> Iterator[ET.Element]:
    """The roots of an MJCF and of the files that it includes, also indirectly."""
    waiting, seen = [path], {path}
    while waiting:
        file = waiting.pop()
        content = read_text(file)
        try:
            tag = "mujocoinclude" if file != path and "<mujocoinclude" in content else "mujoco"
            root = sound(content, tag, "MJCF file")
        except MechlabError as error:
            raise MechlabError(f"{file.name}: {error}" if file != path else str(error)) from None
        yield root
        for include in root.iter("include"):
            name = include.get("file")
            if not name:
                continue
            beside = [Path(_near(home, os.path.join(base, name), include, "file")) for base in (home, str(file.parent))]
            found = next((p for p in beside if p.is_file()), None)
            if found is not None and found not in seen:
                seen.add(found)
                waiting.append(found)
        if len(seen) > MOST_INCLUDES:
            raise MechlabError(f"it includes more than {MOST_INCLUDES} files.")


def _near(home: str, name: str, element: ET.Element, key: str) -> str:
    """The whole path of a file that an element names. Raises MechlabError where it is far from the folder `home` of the model."""
    given = f"{label(element)}: {key}={element.get(key)!r}"
    if "://" in name:
        raise MechlabError(f"{given} is a URL; put the file beside the model and write its path.")
    target = os.path.normpath(os.path.join(home, name))
    common = _common(home, target)
    climbed = 0 if common == home else len(Path(home).parts) - len(Path(common).parts)
    user = os.path.expanduser("~")
    too_high = os.path.dirname(common) == common or _common(user, common) == common
    if climbed and (climbed > LEVELS or too_high):
        raise MechlabError(
            f"{given} leads out of the folder of the model, to {target}. Files beside it, below it and up to {LEVELS} folders "
            "above it are read, but not by way of the root or the home folder. Move the file beside the model."
        )
    try:
        mode = os.stat(target).st_mode
    except (OSError, ValueError):
        return target
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise MechlabError(f"{given} is no ordinary file (a device, a pipe or a socket).")
    return target


def _common(a: str, b: str) -> str:
    try:
        return os.path.commonpath([a, b])
    except ValueError:  # other drives
        return os.path.splitdrive(a)[0] + os.sep
