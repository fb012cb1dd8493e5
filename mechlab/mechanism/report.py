"""How a Mechanism looks: one line for a shell, tables for a terminal, HTML for a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import LOOP_ROWS
from mechlab.mechanism.structure import Structure, structure
from mechlab.results import html_of, line_of, save_result, text_of
from mechlab.tables import counted, html_sheet, table

Rows = tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]


def body_rows(m: Mechanism) -> Rows:
    """Name, parent, joints, mass of each body."""
    rows = [
        (b.name, b.parent, ", ".join(f"{j.name} ({j.kind})" for j in b.joints) or "welded", f"{b.inertia.mass:.4g}")
        for b in m.bodies
    ]
    return ("body", "parent", "joints", "mass [kg]"), tuple(rows)


def closing_rows(m: Mechanism) -> Rows:
    """Loops, relations, curves and shafts."""
    rows = [(x.name, f"{x.kind} loop", str(LOOP_ROWS[x.kind]), f"{x.body_a} - {x.body_b}") for x in m.loops]
    for r in m.relations:
        rows.append((r.name, f"{r.kind} relation", "1", _sum(r.coefficients) + " = 0"))
    for x in m.curves:
        rows.append((x.name, "curve", "1", f"{x.output} = f({x.input}), {counted(len(x.curve.pieces), 'piece')}"))
    for s in m.shafts:
        rows.append((s.name, "shaft", "-", f"{_sum(s.coefficients)}; inertia {s.inertia:.4g} kg m2"))
    return ("name", "kind", "rows", "between"), tuple(rows)


def _sum(coefficients: Sequence[tuple[str, Any]]) -> str:
    text = " ".join(f"{'-' if c < 0 else '+'} {'' if abs(c) == 1 else str(abs(c)) + ' '}{n}" for n, c in coefficients)
    return text.removeprefix("+ ")


def freedom_sentences(found: Structure) -> list[str]:
    """Sentences: the independent coordinates, and whether the reference pose is singular."""
    out = [f"Independent: {', '.join(found.independent) or 'none'}."]
    if found.reference_rank < found.rank:
        out.append(f"The reference pose is singular: rank {found.reference_rank} there, {found.rank} elsewhere.")
    return out


@line_of.register
def _line(m: Mechanism) -> str:
    parts = [counted(len(m.bodies), "body", "bodies"), counted(m.nv, "coordinate")]
    for items, word in ((m.loops, "loop"), (m.relations, "relation"), (m.curves, "curve"), (m.shafts, "shaft"), (m.drives, "drive")):
        parts += [counted(len(items), word)] if items else []
    return f"Mechanism {m.name}: {', '.join(parts)}, {m.total_mass:.4g} kg"


@text_of.register
def _text(m: Mechanism) -> str:
    sentences, tables = _sheet(m)
    blocks = [f"{m.name}\n{'=' * len(m.name)}", *sentences]
    return "\n".join([*blocks, *(f"\n{title}\n{table(*rows)}" for title, rows in tables.items())])


@html_of.register
def _html(m: Mechanism) -> str:
    return html_sheet(m.name, *_sheet(m))


@save_result.register
def _save(m: Mechanism, path: Path) -> Path:
    raise MechlabError(
        f"{m.name}: one file does not hold a Mechanism; mechlab.generate(mechanism, out=folder) writes its files."
    )


def _sheet(m: Mechanism) -> tuple[list[str], dict[str, Rows]]:
    """Sentences (summary, freedoms) and tables: bodies, loops, relations, shafts, redundant rows."""
    found = structure(m)
    sentences = [m.summary] if m.summary else []
    sentences.append(f"{counted(len(m.bodies), 'body', 'bodies')}, {m.total_mass:.4g} kg, {found.sentence}.")
    return [*sentences, *freedom_sentences(found)], part_tables(m, found)


def part_tables(m: Mechanism, found: Structure) -> dict[str, Rows]:
    """Tables of the parts: bodies; loops, relations, shafts; redundant rows."""
    tables = {"Bodies": body_rows(m)}
    if m.is_closed or m.shafts:
        tables["Loops, relations, shafts"] = closing_rows(m)
    if found.redundant:
        tables["Redundant rows"] = (("row",), tuple((r.sentence,) for r in found.redundant))
    return tables
