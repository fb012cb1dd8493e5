"""What a fidelity can answer, read from its Mechanism: a reaction can be read where there is a row or a part for it."""

from __future__ import annotations

from collections.abc import Sequence

from mechlab.errors import unknown
from mechlab.experiment.scene import NEEDS
from mechlab.mechanism.model import Mechanism
from mechlab.study.design import Design

CLOSED_FORM = "kinematic"


def levels(design: Design) -> tuple[str, ...]:
    """The fidelities that have a Mechanism, cheapest first."""
    return tuple(f for f in design.entry.fidelities if f != CLOSED_FORM)


def checked_needs(needs: Sequence[str]) -> tuple[str, ...]:
    """The needs, each of `NEEDS`; raises MechlabError that lists them."""
    for need in needs:
        if need not in NEEDS:
            raise unknown("need", need, NEEDS)
    return tuple(needs)


def missing_answers(m: Mechanism, richest: Mechanism) -> dict[str, str]:
    """Need -> why this mechanism cannot answer it; what is not in it, it answers.

    poses, drive_forces: every Mechanism. tooth_loads: it needs a row for the gears. reactions: it needs every loop, every
    gear row and every part of the richest fidelity under its name; lumped parts have no reactions between them.
    """
    out: dict[str, str] = {}
    if not m.relations:
        out["tooth_loads"] = (
            "its gears are shafts without rows" if richest.relations else "no fidelity has rows of gears"
        )
    for what, mine, all_of in (
        ("loop", {x.name for x in m.loops}, {x.name for x in richest.loops}),
        ("gear row", {x.name for x in m.relations}, {x.name for x in richest.relations}),
        ("part", {x.name for x in m.bodies}, {x.name for x in richest.bodies}),
    ):
        lost = sorted(all_of - mine)
        if lost:
            names = ", ".join(lost[:3]) + (", ..." if len(lost) > 3 else "")
            out["reactions"] = f"it has no {what} {names}"
            break
    return out
