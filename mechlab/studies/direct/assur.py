"""The question `assur` on a file of links: all assembly modes of a planar linkage at an angle of its drives, with rates and accelerations;
over many angles its branches, as a table and as curves."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.analytic.assur.link_modes import LinkModes, branches, modes_by_trial, modes_of
from mechlab.analytic.assur.links import Links
from mechlab.errors import MechlabError
from mechlab.experiment.question import Answer, Answers, Question
from mechlab.files import write
from mechlab.kit.links_file import read_links
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Status
from mechlab.mechanism.geometry import Array
from mechlab.studies.direct.keys import known_keys, number_of
from mechlab.studies.picture_style import new_figure, open_frame, save_figure
from mechlab.tables import counted

NAME = "assur"
FILES = {"table": (".csv",), "curves": (".png", ".svg", ".pdf")}
UNITS = {"": "rad", "_rate": "rad/s", "_accel": "rad/s2"}
OF_SLIDES = {"": "m", "_rate": "m/s", "_accel": "m/s2"}
MOST_POSITIONS = 5000
STARTS, MOST_TRIALS = 40, 100_000
"""Random starts of the second witness at a position, times the largest number of modes; and altogether."""


@dataclass(frozen=True)
class Asked:
    """The linkage of the file, and angles, rates and accelerations (n, drives) of its drives; single: one position was asked for."""

    linkage: Links
    angles: Array
    rates: Array
    accels: Array
    single: bool


def solve_assur(values: Mapping[str, Any]) -> Answers:
    """The answers to links=FILE DRIVE=angle ... [DRIVE_rate=... DRIVE_accel=... table=FILE.csv curves=FILE.png].

    Raises MechlabError for an unknown or missing key, a bad file, a linkage that drives and loops do not determine.
    """
    if "links" not in values:
        raise MechlabError(f"{NAME}: links is missing; give links=FILE.json with the keys fixed, links, drives, or FILE.csv.")
    linkage = read_links(str(values["links"]))
    keys = {f"{d}{end}": unit for d in linkage.drives for end, unit in UNITS.items()}
    known_keys(NAME, values, ("links", *keys, *FILES))
    for key, suffixes in FILES.items():
        if key in values and Path(str(values[key])).suffix.lower() not in suffixes:
            raise MechlabError(f"{NAME}: {key}: expected a name that ends in {', '.join(suffixes)}, got {values[key]}.")
    missing = [d for d in linkage.drives if d not in values]
    if missing:
        raise MechlabError(f"{NAME}: {missing[0]} is missing; give the angle of each drive: {', '.join(linkage.drives)}.")
    given = {k: number_of(NAME, k, values[k], unit, True) for k, unit in keys.items() if k in values}
    asked = _positions(linkage, given)
    question = _question(linkage)
    found = modes_of(linkage, asked.angles, asked.rates, asked.accels)
    answers = {"homotopy": _answer(asked, found, True)}
    if len(asked.angles) * STARTS * found.bound <= MOST_TRIALS:
        tried = modes_by_trial(linkage, asked.angles, asked.rates, asked.accels, STARTS)
        answers["newton"] = _answer(asked, tried, False)
        loose = tried.count > found.bound  # more than there can be separate ones
        if loose.any():
            answers = _with_loose(asked, answers, found, tried, loose)
    else:
        answers["newton"] = Answer(cannot=f"it tries {MOST_TRIALS} random starts at most; ask for fewer positions")
    if "table" in values:
        write(Path(str(values["table"])), table_text(asked, found))
    if "curves" in values:
        _curves(asked, found, Path(str(values["curves"])))
    parameters = {k: str(values[k]) for k in ("links", *FILES) if k in values}
    return Answers(NAME, answers, units=question.units, parameters=parameters, given=given)


def _positions(linkage: Links, given: Mapping[str, Any]) -> Asked:
    if not linkage.drives:
        return Asked(linkage, np.zeros((1, 0)), np.zeros((1, 0)), np.zeros((1, 0)), True)
    arrays = [np.asarray(given.get(f"{d}{end}", 0.0), dtype=float) for end in UNITS for d in linkage.drives]
    try:
        arrays = [np.asarray(a) for a in np.broadcast_arrays(*arrays)]
    except ValueError:
        raise MechlabError(f"{NAME}: the drives have different numbers of angles, rates or accelerations.") from None
    if arrays[0].ndim > 1 or arrays[0].size > MOST_POSITIONS:
        raise MechlabError(f"{NAME}: expected a list of at most {MOST_POSITIONS} positions.")
    x, v, a = (np.column_stack([np.atleast_1d(y) for y in part]) for part in np.array_split(np.array(arrays), 3))
    return Asked(linkage, x, v, a, arrays[0].ndim == 0)


def _answer(asked: Asked, found: LinkModes, proves: bool) -> Answer:
    """One position: turns, rates and accelerations of each link over the modes; many: the number of modes, and the branches."""
    notes: list[str] = []
    if proves:
        lost = int(found.lost.sum())
        ends = f"{int(found.infinite.max())} at infinity, " if found.infinite.max() else ""
        notes.append(
            f"at most {found.bound} modes; all {found.bound} paths reached their ends ({ends}the others real or complex)" if not lost
            else f"{lost} of {found.bound * len(found.count)} paths were lost: modes may be missing"
        )  # fmt: skip
    status = Status.SOLVED if found.count.any() else Status.NO_ASSEMBLY
    if proves and found.lost.any():
        status = Status.NOT_CONVERGED
    if asked.single:
        return _one_position(asked, found, status, notes)
    values = {"mode_count": found.count.astype(float)}
    if not proves:
        return Answer(values, status)
    number = branches(found)
    return Answer(values, status, tuple(notes), details={"branches": [_branch(asked, found, number, b) for b in range(number.max() + 1)]})


def _one_position(asked: Asked, found: LinkModes, status: Status, notes: list[str]) -> Answer:
    count = int(found.count[0])
    values: dict[str, Any] = {"mode_count": float(count)}
    if count:
        for k, link in enumerate(asked.linkage.quantities):
            values |= {f"{link}{end}": x[0, :count, k] for end, x in zip(UNITS, (found.turns, found.rates, found.accels), strict=True)}
        values["det"] = found.det[0, :count]
    if not np.isfinite(found.rates[0, :count]).all():
        status, notes = Status.BOUNDARY, [*notes, "two modes merge here: rates do not exist"]
        values = {k: v for k, v in values.items() if not k.endswith(("_rate", "_accel"))}
    return Answer(values, status, tuple(notes))


def _with_loose(asked: Asked, answers: Mapping[str, Answer], found: LinkModes, tried: LinkModes, loose: np.ndarray) -> dict[str, Answer]:
    """The answers where, at some positions, a part moves though all drives are held: no finite number of modes."""
    first, drive = int(np.argmax(loose)), asked.linkage.drives
    where = "here" if asked.single else f"at {counted(int(loose.sum()), 'position')}, the first of them {first + 1}" + (
        f" ({drive[0]} = {np.degrees(asked.angles[first, 0]):.6g} deg)" if drive else "")  # fmt: skip
    note = (
        f"{where} a part moves freely though the drives are held: trials close it in {int(tried.count[first])} places, "
        f"separate modes there are at most {found.bound}"
    )
    if asked.single:
        return {who: Answer({}, Status.MODES_MERGE, (note,) if who == "homotopy" else ()) for who in answers}
    counts = {who: {"mode_count": np.where(loose, 0, x.count).astype(float)} for who, x in (("homotopy", found), ("newton", tried))}
    notes = {"homotopy": (*answers["homotopy"].notes, f"{note}; counted as 0"), "newton": ()}
    return {who: replace(a, values=counts[who], notes=notes[who]) for who, a in answers.items()}


def _branch(asked: Asked, found: LinkModes, number: np.ndarray, branch: int) -> dict[str, Any]:
    row, slot = np.nonzero(number == branch)
    out: dict[str, Any] = {"branch": branch + 1, "position": (row + 1).tolist(), "det": found.det[row, slot].tolist()}
    out |= {d: asked.angles[row, k].tolist() for k, d in enumerate(asked.linkage.drives)}
    for k, link in enumerate(asked.linkage.quantities):
        out[link] = _steady(found, row, slot, k).tolist()
        out |= {f"{link}{end}": _finite(x[row, slot, k]) for end, x in (("_rate", found.rates), ("_accel", found.accels))}
    return out


def _steady(found: LinkModes, row: np.ndarray, slot: np.ndarray, k: int) -> Array:
    """A quantity along a branch: a turn without jumps by full ones, a place as it is."""
    x = found.turns[row, slot, k]
    return np.unwrap(x) if k < found.turning else x


def _finite(x: Array) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in x]


def table_text(asked: Asked, found: LinkModes) -> str:
    """CSV: a row for each mode at each position: its branch, drives, turns, rates and accelerations of all links [rad, s] and places of
    the slides [m, s], det."""
    links = [f"{n}{end}" for n in asked.linkage.quantities for end in UNITS]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["position", "branch", *asked.linkage.drives, *links, "det"])
    number = branches(found)
    for i, count in enumerate(found.count):
        for k in sorted(range(count), key=lambda k, i=i: number[i, k]):  # type: ignore[misc]
            motion = np.stack([found.turns[i, k], found.rates[i, k], found.accels[i, k]], axis=-1).ravel()
            row = [*asked.angles[i], *motion, found.det[i, k]]
            writer.writerow([i + 1, number[i, k] + 1, *(f"{x:.17g}" if np.isfinite(x) else "" for x in row)])
    return text.getvalue()


def _curves(asked: Asked, found: LinkModes, path: Path) -> None:
    """Turn or place, and rate, of each link and slide over the first drive, a line for each branch."""
    links, number = asked.linkage.quantities, branches(found)
    picture = new_figure(10.0, 2.2 * len(links) + 0.6, 100, layout="constrained")
    axes = picture.subplots(len(links), 2, squeeze=False, sharex=True)
    for b in range(number.max() + 1):
        row, slot = np.nonzero(number == b)
        drive = np.degrees(asked.angles[row, 0]) if asked.linkage.drives else row + 1.0
        look: dict[str, Any] = {"lw": 1.4, "marker": "." if len(row) < 3 else "", "color": f"C{b % 10}"}
        for k in range(len(links)):
            x = _steady(found, row, slot, k)
            axes[k][0].plot(drive, np.degrees(x) if k < found.turning else x, label=f"branch {b + 1}", **look)
            axes[k][1].plot(drive, found.rates[row, slot, k], **look)
    for k, link in enumerate(links):
        units = ("deg", "rad/s") if k < found.turning else ("m", "m/s")
        axes[k][0].set_ylabel(f"{link} [{units[0]}]")
        axes[k][1].set_ylabel(f"{link}_rate [{units[1]}]")
        for a in axes[k]:
            a.grid(True, color="#e3e6ea", lw=0.6)
            open_frame(a)
    for a in axes[-1]:
        a.set_xlabel(f"{asked.linkage.drives[0]} [deg]" if asked.linkage.drives else "position")
    if 0 < number.max() + 1 <= 12:
        picture.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=6, frameon=False, fontsize=9)
    save_figure(picture, path)


def _question(linkage: Links | None) -> Question:
    drives = linkage.drives if linkage else ("DRIVE",)
    links = linkage.quantities if linkage else ("LINK",)
    turns = linkage.unknowns if linkage else links
    units = {f"{n}{end}": unit for n in (*drives, *turns) for end, unit in UNITS.items()}
    units |= {f"{n}{end}": unit for n in links if n not in turns for end, unit in OF_SLIDES.items()}
    none: Callable[[Any, Mapping[str, Any]], Answer] = lambda p, given: Answer(cannot="it needs a file")  # noqa: E731
    return Question(
        NAME, ("links", *drives), ("mode_count", *(f"{n}{end}" for n in links for end in UNITS), "det"),
        {"homotopy": none, "newton": none}, dict.fromkeys((*(f"{d}{end}" for d in drives for end in UNITS if end), *FILES)),
        units=units | dict.fromkeys(("links", "mode_count", "det", *FILES), ""), angles=turns,
        text="all assembly modes of a planar linkage of rigid links, pins and slides (any Assur group of up to five loops), with rates and "
        "accelerations, at angles of its drives; over many angles the branches as a table and as curves",
    )  # fmt: skip


QUESTION = _question(None)
