"""A B-spline curve in a JSON file: degree, knots, points, and optionally a name and the unit of the points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mechlab.analytic.bspline import BSpline
from mechlab.errors import MechlabError, unknown
from mechlab.units import UNITS

REQUIRED = ("degree", "knots", "points")
OPTIONAL = ("name", "unit")
LARGEST = 1e9
"""Largest knot or coordinate: squares and cubes of it stay far inside the range of a double."""
LENGTHS = tuple(k for k, u in UNITS.items() if u.si == "m")


def read_curve(path: str | Path, coordinates: tuple[int, ...] = ()) -> BSpline:
    """The curve of a file: {"degree": p, "knots": [...], "points": [[x, y, ...], ...]}, points in metres or in "unit".

    The unit applies to the first three coordinates; further ones are angles [rad]. coordinates: allowed numbers of
    coordinates of a point, () for any. Raises MechlabError, naming the file and the error in it.
    """
    from mechlab.formats.json_text import parse  # and all formats: not before a file is read

    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MechlabError(f"curve: cannot read {file}: {getattr(error, 'strerror', None) or error}.") from None
    document = parse(text, f"curve {file}")
    for key in document:
        if key not in (*REQUIRED, *OPTIONAL):
            raise unknown(f"curve {file}: the key", key, (*REQUIRED, *OPTIONAL))
    missing = [k for k in REQUIRED if k not in document]
    if missing:
        raise MechlabError(f"curve {file}: {', '.join(missing)} missing; expected the keys {', '.join(REQUIRED)}.")
    factor = _factor(document.get("unit", "m"), file)
    name = document.get("name", "")
    if not isinstance(name, str):
        raise MechlabError(f"curve {file}: name: expected a text, got {type(name).__name__}.")
    try:
        curve = BSpline(document["degree"], document["knots"], document["points"])
    except MechlabError as error:
        raise MechlabError(f"curve {file}: {error}") from None
    largest = max(map(abs, (*curve.knots, *(x for row in curve.points for x in row))))
    if largest > LARGEST:
        raise MechlabError(f"curve {file}: {largest:g} is too large; expected knots and coordinates up to {LARGEST:g}.")
    count = len(curve.points[0])
    if coordinates and count not in coordinates:
        wanted = " or ".join(str(n) for n in coordinates)
        raise MechlabError(f"curve {file}: points: expected {wanted} coordinates, got {count}.")
    if factor == 1.0:
        return curve
    return BSpline(curve.degree, curve.knots, tuple((*(factor * x for x in row[:3]), *row[3:]) for row in curve.points))


def _factor(unit: Any, file: Path) -> float:
    if not isinstance(unit, str) or unit not in LENGTHS:
        raise unknown(f"curve {file}: unit", unit, LENGTHS)
    return float(UNITS[unit].factor)
