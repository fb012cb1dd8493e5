"""Measured series: a CSV file or a mapping of columns, in SI, with gaps."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.units import UNITS, compact, described

TIME = "t"
"""The first column of data over time."""
GAPS = ("", "nan", "na", "-")
"""Cells without a measurement, in lower case."""
HEAD = re.compile(r"\s*(.*?)\s*(?:\[(.*?)\])?\s*")
LARGEST_FILE = 100_000_000
"""Most bytes of a table."""

Data = str | Path | Mapping[str, Any]
"""A CSV file, or column -> values (n,), with the heads of the file as keys."""


@dataclass(frozen=True)
class MeasuredTable:
    """Columns of measurements in SI: name -> (n,), NaN where there is a gap; units: as written ("" where no unit was). where: for
    messages."""

    columns: Mapping[str, Array]
    units: Mapping[str, str]
    where: str

    @property
    def first(self) -> str:
        """Name of the first column."""
        return next(iter(self.columns))

    @property
    def over_time(self) -> bool:
        """Whether the first column is the time."""
        return self.first == TIME

    def in_units(self, units: Mapping[str, str]) -> dict[str, Array]:
        """The columns named in `units` in SI. Raises MechlabError for a unit that measures something else."""
        return {name: self._column(name, si) for name, si in units.items()}

    def _column(self, name: str, si: str) -> Array:
        written = self.units[name]
        if written in ("", si) or compact(written) == compact(si):
            return self.columns[name]
        unit = UNITS.get(compact(written))
        if unit is None or unit.si not in (si, compact(si)):
            raise MechlabError(f"{self.where}: column {name}: expected {described(si)}, got [{written}].")
        return self.columns[name] * unit.to_si(Fraction(1))


def read_table(data: Data) -> MeasuredTable:
    """The table of a CSV file or a mapping: heads "name [unit]", numbers, empty cells for gaps.

    Lines that begin with # are comments; the separator is a comma, a semicolon or a tab. Raises MechlabError that names file, line and
    column for what is no number, for rows of another length, for names that come twice, and for times that do not increase.
    """
    if isinstance(data, Mapping):
        where, heads = "data", [str(k) for k in data]
        values = [_numbers(where, k, v) for k, v in data.items()]
        if len({len(v) for v in values}) > 1:
            lengths = ", ".join(f"{h} {len(v)}" for h, v in zip(heads, values, strict=True))
            raise MechlabError(f"{where}: expected columns of one length, got {lengths}.")
    else:
        where = str(data)
        heads, values = _read_file(Path(data))
    names, units = [], {}
    for head in heads:
        found = HEAD.fullmatch(head)
        name, unit = (found[1], found[2] or "") if found else (head, "")
        if not name or name in names:
            raise MechlabError(f"{where}: the column {head!r} {'has no name' if not name else 'comes twice'}.")
        names.append(name)
        units[name] = unit
    table = MeasuredTable(dict(zip(names, values, strict=True)), units, where)
    _check(table)
    return table


def _check(table: MeasuredTable) -> None:
    first = table.columns.get(table.first) if table.columns else None
    if first is None or len(table.columns) < 2 or len(first) < 2:
        raise MechlabError(
            f"{table.where}: expected a first column {TIME} [s] (or a drive), at least one measured column and two rows."
        )
    if not np.all(np.isfinite(first)):
        raise MechlabError(f"{table.where}: the first column, {table.first}, has gaps; only measured columns may have them.")
    if table.over_time:
        t = table.in_units({TIME: "s"})[TIME]
        if t[0] < 0.0:
            raise MechlabError(f"{table.where}: times count from the start of the scene, at 0 s; the first is {t[0]:g} s.")
        if not np.all(np.diff(t) > 0.0):
            k = int(np.argmin(np.diff(t)))
            raise MechlabError(f"{table.where}: times must increase: row {k + 2} has {t[k + 1]:g} s after {t[k]:g} s.")
    empty = [n for n, x in table.columns.items() if not np.any(np.isfinite(x))]
    if empty:
        raise MechlabError(f"{table.where}: nothing is measured in {', '.join(empty)}; leave the column out.")


def _numbers(where: str, name: str, values: Any) -> Array:
    try:
        out = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise MechlabError(f"{where}: {name}: expected numbers.") from None
    if out.ndim != 1 or np.any(np.isinf(out)):
        raise MechlabError(f"{where}: {name}: expected a series (n,) of finite numbers (NaN for a gap), got shape {out.shape}.")
    return out


def _read_file(path: Path) -> tuple[list[str], list[Array]]:
    if not path.is_file():
        raise MechlabError(f"there is no file {path}.")
    if path.stat().st_size > LARGEST_FILE:
        raise MechlabError(f"{path}: more than {LARGEST_FILE} bytes; keep fewer rows.")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise MechlabError(f"{path}: this is no UTF-8 text; expected a CSV table.") from None
    lines = [(k, s) for k, s in enumerate(text.splitlines(), 1) if s.strip() and not s.lstrip().startswith("#")]
    if not lines:
        raise MechlabError(f"{path}: the table is empty; expected a line of heads such as t [s],angle [rad] and rows of numbers.")
    separator = next((s for s in ("\t", ";", ",") if s in lines[0][1]), ",")
    rows = list(csv.reader([s for _, s in lines], delimiter=separator))
    heads = [h.strip() for h in rows[0]]
    if all(_is_number(h) for h in heads):
        raise MechlabError(f"{path}: the first line has no heads but numbers; expected for example t [s],angle [rad].")
    cells: list[list[float]] = [[] for _ in heads]
    for (line, _), row in zip(lines[1:], rows[1:], strict=False):
        if len(row) != len(heads):
            raise MechlabError(f"{path}, line {line}: expected {len(heads)} cells, got {len(row)}.")
        for column, head, cell in zip(cells, heads, row, strict=True):
            column.append(_cell(path, line, head, cell.strip()))
    return heads, [np.array(c) for c in cells]


def _cell(path: Path, line: int, head: str, text: str) -> float:
    if text.lower() in GAPS:
        return float("nan")
    if not _is_number(text):
        raise MechlabError(f"{path}, line {line}, column {head}: expected a finite number or an empty cell, got {text!r}.")
    return float(text)


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False


def noise_of(where: str, noise: Mapping[str, float] | None, channels: Sequence[str]) -> dict[str, float]:
    """Stated standard deviations by channel. Raises MechlabError for other names and for what is no positive number."""
    out = {}
    for name, value in (noise or {}).items():
        if name not in channels:
            raise MechlabError(f"{where}: noise of {name}: the measured channels are {', '.join(channels)}.")
        if not (np.isfinite(value) and float(value) > 0.0):
            raise MechlabError(f"{where}: noise of {name}: expected a standard deviation > 0, got {float(value):g}.")
        out[name] = float(value)
    return out
