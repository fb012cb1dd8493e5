"""A mechanism in tables: bodies, what closes them, freedoms. A notebook shows a Mechanism so."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import LOOP_ROWS
from mechlab.mechanism.structure import Structure, structure
from mechlab.tables import counted, html_sheet

Rows = tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]


def body_rows(m: Mechanism) -> Rows:
    """Name, parent, joints, mass of each body."""
    rows = [
        (b.name, b.parent, ", ".join(f"{j.name} ({j.kind})" for j in b.joints) or "welded", f"{b.inertia.mass:.4g}")
        for b in m.bodies
    ]
    return ("body", "parent", "joints", "mass [kg]"), tuple(rows)


def closing_rows(m: Mechanism) -> Rows:
    """Loops, relations and shafts."""
    rows = [(x.name, f"{x.kind} loop", str(LOOP_ROWS[x.kind]), f"{x.body_a} - {x.body_b}") for x in m.loops]
    for r in m.relations:
        rows.append((r.name, f"{r.kind} relation", "1", _sum(r.coefficients) + " = 0"))
    for s in m.shafts:
        rows.append((s.name, "shaft", "-", f"{_sum(s.coefficients)}; inertia {s.inertia:.4g} kg m2"))
    return ("name", "kind", "rows", "between"), tuple(rows)


def _sum(coefficients: Sequence[tuple[str, Any]]) -> str:
    text = " ".join(f"{'-' if c < 0 else '+'} {'' if abs(c) == 1 else str(abs(c)) + ' '}{n}" for n, c in coefficients)
    return text.removeprefix("+ ")


def freedom_sentences(found: Structure) -> list[str]:
    """What is independent, and whether the reference pose is singular."""
    out = [f"Independent: {', '.join(found.independent) or 'none'}."]
    if found.reference_rank < found.rank:
        out.append(f"The reference pose is singular: rank {found.reference_rank} there, {found.rank} elsewhere.")
    return out


def mechanism_html(m: Mechanism) -> str:
    """Name, freedoms, bodies, loops, relations, shafts, redundant rows, as escaped HTML."""
    found = structure(m)
    sentences = [m.summary] if m.summary else []
    sentences.append(f"{counted(len(m.bodies), 'body', 'bodies')}, {m.total_mass:.4g} kg, {found.sentence}.")
    tables = {"Bodies": body_rows(m)}
    if m.loops or m.relations or m.shafts:
        tables["Loops, relations, shafts"] = closing_rows(m)
    if found.redundant:
        tables["Redundant rows"] = (("row",), tuple((r.sentence,) for r in found.redundant))
    return html_sheet(m.name, [*sentences, *freedom_sentences(found)], tables)
