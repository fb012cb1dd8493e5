"""All channels of a Recording as a table that any spreadsheet reads."""

from __future__ import annotations

import csv
import io
import os
from pathlib import Path

from mechlab.experiment.recording import Recording
from mechlab.files import write


def recording_to_csv(recording: Recording) -> str:
    """CSV text: the time, then every channel, each column headed "name [unit]"; one row for each recorded time.

    Numbers are written so that they read back bit for bit; a value that is not finite is an empty field.
    """
    heads = ["t [s]"]
    for name in recording.channels:
        unit = recording.units.get(name, "")
        heads.append(f"{name} [{unit}]" if unit else name)
    columns = [recording.t, *recording.channels.values()]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(heads)
    for row in zip(*(column.tolist() for column in columns), strict=True):
        writer.writerow([repr(x) if abs(x) < float("inf") else "" for x in row])
    return out.getvalue()


def write_csv(recording: Recording, path: str | os.PathLike[str]) -> Path:
    """Writes `recording_to_csv` to `path`, whole or not at all, and returns the path. Raises OSError."""
    return write(path, recording_to_csv(recording))
