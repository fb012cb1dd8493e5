"""The licence of a model file: what the file itself says, a licence file above it, or a mapping of the user."""

from __future__ import annotations

import re
from collections.abc import Mapping
from fnmatch import fnmatch
from pathlib import Path

_NAMES = (
    (r"apache license,?\s+version 2\.0", "Apache-2.0"),
    (r"gnu lesser general public license.{0,80}version 3", "LGPL-3.0"),
    (r"gnu lesser general public license", "LGPL"),
    (r"gnu affero general public license", "AGPL-3.0"),
    (r"gnu general public license.{0,80}version 3", "GPL-3.0"),
    (r"gnu general public license.{0,80}version 2", "GPL-2.0"),
    (r"mozilla public license,?\s+version 2\.0", "MPL-2.0"),
    (r"attribution-noncommercial-noderiv|by-nc-nd", "CC BY-NC-ND"),
    (r"attribution-noncommercial", "CC BY-NC"),
    (r"attribution-sharealike 4\.0|cc[ -]by-sa[ -]4\.0", "CC BY-SA 4.0"),
    (r"attribution 4\.0|cc[ -]by[ -]4\.0", "CC BY 4.0"),
    (r"\bisc license\b|permission to use, copy, modify, and/or distribute", "ISC"),
    (r"\bmit license\b|permission is hereby granted, free of charge", "MIT"),
    (r"bsd 3-clause|neither the name of", "BSD-3-Clause"),
    (r"bsd 2-clause|redistribution and use in source and binary forms", "BSD-2-Clause"),
)
_FILES = ("licen[cs]e*", "copying*")
READ = 20_000
"""Characters of a file in which a licence is looked for."""


def recognised(text: str) -> str:
    """The short name of the first licence that a text names, "" for none."""
    lower = " ".join(text[:READ].lower().split())
    found = [(match.start(), k, name) for k, (pattern, name) in enumerate(_NAMES) if (match := re.search(pattern, lower))]
    return min(found)[2] if found else ""


def licence_of(path: Path, top: Path, name: str, known: Mapping[str, str]) -> str:
    """The licence of a model: by the file itself, the nearest licence file in its folders up to `top`, or the mapping (pattern of the
    name -> licence); "" where none is found."""
    return recognised(_text(path)) or _above(path.parent, top) or next((v for p, v in known.items() if fnmatch(name, p)), "")


def _above(folder: Path, top: Path) -> str:
    while True:
        files = sorted(f for f in folder.iterdir() if f.is_file() and any(fnmatch(f.name.lower(), p) for p in _FILES))
        found = next((licence for f in files if (licence := recognised(_text(f)))), "")
        if found or folder == top or top not in folder.parents:
            return found
        folder = folder.parent


def _text(path: Path) -> str:
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            return file.read(READ)
    except OSError:
        return ""
