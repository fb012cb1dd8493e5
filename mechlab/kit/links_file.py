"""A planar linkage of rigid links in a file, for the question `assur`.

JSON: {"fixed": {"O": [0, 0]}, "links": {"crank": {"O": [0, 0], "A": [0.2, 0]}, "rod": ["A", "B", 0.5]}, "drives": ["crank"]}, and
optionally name, unit and slides, {"s": {"point": "B", "guide": "ground", "through": [0, 0], "along": [1, 0]}}: the point lies on that line
of the guide, a link or the ground. A link is its points in its own axes, or, with two points, their names and distance. CSV, without
slides: a table with the columns link, point, x, y, in metres; the link `ground` has the fixed points, and a word in a further column
`drive` marks a driven link.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from mechlab.analytic.assur.links import GROUND, Links, Slide
from mechlab.errors import MechlabError, unknown
from mechlab.formats.json_text import parse
from mechlab.units import UNITS

REQUIRED, OPTIONAL = ("fixed", "links", "drives"), ("name", "unit", "slides")
OF_A_SLIDE = ("point", "guide", "through", "along")
COLUMNS = ("link", "point", "x", "y")
LARGEST = 1e6
LENGTHS = tuple(k for k, u in UNITS.items() if u.si == "m")


def read_links(path: str | Path) -> Links:
    """The linkage of a .json or .csv file. Raises MechlabError, naming the file and the error in it."""
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MechlabError(f"links: cannot read {file}: {getattr(error, 'strerror', None) or error}.") from None
    try:
        return _from_csv(text) if file.suffix.lower() == ".csv" else _from_json(text)
    except MechlabError as error:
        raise MechlabError(f"links {file}: {error}") from None


def _from_json(text: str) -> Links:
    document = parse(text, "the file")
    for key in document:
        if key not in (*REQUIRED, *OPTIONAL):
            raise unknown("the key", key, (*REQUIRED, *OPTIONAL))
    missing = [k for k in REQUIRED if k not in document]
    if missing:
        raise MechlabError(f"{', '.join(missing)} missing; expected the keys {', '.join(REQUIRED)}.")
    unit = document.get("unit", "m")
    if not isinstance(unit, str) or unit not in LENGTHS:
        raise unknown("unit", unit, LENGTHS)
    factor = float(UNITS[unit].factor)
    fixed, links, drives = (document[k] for k in REQUIRED)
    if not isinstance(fixed, dict) or not isinstance(links, dict) or not isinstance(drives, list):
        raise MechlabError("expected fixed and links as objects and drives as a list.")
    if not all(isinstance(d, str) for d in drives):
        raise MechlabError("drives: expected names of links.")
    made = {str(name): _link(str(name), value, factor) for name, value in links.items()}
    slides = document.get("slides", {})
    if not isinstance(slides, dict):
        raise MechlabError("expected slides as an object.")
    ground = {str(n): _point(f"fixed point {n!r}", xy, factor) for n, xy in fixed.items()}
    return Links(made, ground, tuple(drives), {str(n): _slide(str(n), value, factor) for n, value in slides.items()})


def _slide(name: str, value: Any, factor: float) -> Slide:
    if not isinstance(value, dict) or set(value) != set(OF_A_SLIDE) or not all(isinstance(value[k], str) for k in OF_A_SLIDE[:2]):
        raise MechlabError(
            f'slide {name!r}: expected {{"point": "P", "guide": LINK or "{GROUND}", "through": [x, y], "along": [dx, dy]}}, got {value!r}.'
        )
    through, along = (_point(f"slide {name!r}, {k}", value[k], factor) for k in OF_A_SLIDE[2:])
    return Slide(value["point"], value["guide"], through, along)


def _link(name: str, value: Any, factor: float) -> dict[str, complex]:
    if isinstance(value, list):
        if len(value) != 3 or not isinstance(value[0], str) or not isinstance(value[1], str):
            raise MechlabError(f'link {name!r}: expected ["P", "Q", length], or {{"P": [x, y], ...}}, got {value!r}.')
        length = _number(f"link {name!r}: length", value[2], factor)
        if length <= 0.0 or value[0] == value[1]:
            raise MechlabError(f"link {name!r}: expected two points and a length above 0, got {value!r}.")
        return {value[0]: 0j, value[1]: complex(length)}
    if not isinstance(value, dict) or len(value) < 2:
        raise MechlabError(f'link {name!r}: expected two points or more, {{"P": [x, y], ...}}, got {value!r}.')
    return {str(p): _point(f"link {name!r}, point {p!r}", xy, factor) for p, xy in value.items()}


def _point(what: str, xy: Any, factor: float) -> complex:
    if not isinstance(xy, list) or len(xy) != 2:
        raise MechlabError(f"{what}: expected [x, y], got {xy!r}.")
    return complex(_number(what, xy[0], factor), _number(what, xy[1], factor))


def _number(what: str, value: Any, factor: float = 1.0) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise MechlabError(f"{what}: expected a number up to {LARGEST:g}, got {value!r}.")
    return factor * float(value)


def _from_csv(text: str) -> Links:
    table = csv.DictReader(text.splitlines(), skipinitialspace=True)
    columns = tuple(table.fieldnames or ())
    missing = [c for c in COLUMNS if c not in columns]
    if missing:
        raise MechlabError(f"column {', '.join(missing)} missing; expected {', '.join(COLUMNS)}, and drive where a link is driven.")
    links: dict[str, dict[str, complex]] = {}
    fixed: dict[str, complex] = {}
    drives: list[str] = []
    for number, row in enumerate(table, 2):
        link, point = ((row[c] or "").strip() for c in ("link", "point"))
        where = f"line {number}"
        if not link or not point:
            raise MechlabError(f"{where}: expected the names of a link and of a point.")
        try:
            at = complex(_number(where, float(row["x"])), _number(where, float(row["y"])))
        except (TypeError, ValueError):
            raise MechlabError(f"{where}: expected numbers x and y, got {row['x']!r} and {row['y']!r}.") from None
        points = fixed if link == GROUND else links.setdefault(link, {})
        if point in points:
            raise MechlabError(f"{where}: point {point!r} of {link!r} stands twice.")
        points[point] = at
        if (row.get("drive") or "").strip() and link not in drives:
            drives.append(link)
    if not links:
        raise MechlabError(f"no row for a link; expected rows with {', '.join(COLUMNS)}, and drive where a link is driven.")
    return Links(links, fixed, tuple(drives))
