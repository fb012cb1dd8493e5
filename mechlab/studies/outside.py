"""The numbers from outside of the lab beside ours: tables for sheets and for the whole catalog."""

from __future__ import annotations

import re
from collections.abc import Sequence

from mechlab.experiment.entry import CheckResult, Entry, Outside
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.structure import structure
from mechlab.tables import markdown, number

HEADERS = ("what", "from outside", "ours", "difference", "unit", "source")


@dataclass(frozen=True)
class OutsideNumber:
    """A number from outside and what the witnesses measure."""

    number: Outside
    measured: CheckResult

    @property
    def row(self) -> tuple[str, ...]:
        """Cells below HEADERS; ours is that of the witness that is farthest off."""
        expected = float(self.measured.expected)
        ours = max((float(x) for x in self.measured.values.values()), key=lambda x: abs(x - expected))
        apart = abs(ours - expected)
        shown = "below 1e-9" if apart < 1e-9 else number(apart, 2)
        return self.number.text, _plain(expected), _plain(ours), shown, self.number.unit or "-", self.number.source


def _plain(value: float) -> str:
    """Nine digits; what is rounding beside 1 is 0."""
    return number(0.0 if abs(value) < 1e-9 else value, 9)


def first_from_outside(entry: Entry) -> OutsideNumber | None:
    """The first number from outside of an entry with default parameters, measured by all its witnesses; None where it has none."""
    for o in entry.outside:
        return OutsideNumber(o, {c.text: c for c in entry.checks}[o.text].run(entry.parameters()))
    return None


def catalog_table(entries: Sequence[Entry], before: str = "", order: Sequence[str] = ()) -> str:
    """The README of models/: every entry with its family and freedoms, and its first number from outside.

    before: a table made earlier, whose rows of other entries stay; order: the names of all rows, as they are to stand.
    """
    rows = []
    for entry in entries:
        level = list(entry.fidelities)[-1]
        freedoms = str(structure(entry.build(entry.parameters(), level)).freedoms)
        name = f"[{entry.name}]({entry.name}/README.md)"
        found = first_from_outside(entry)
        rows.append((name, entry.family, freedoms, *(found.row if found else ("see its checks and claims", "", "", "", "", ""))))
    head = ["# The mechanisms", "", "![All mechanisms](gallery.png)", ""]
    text = (
        "Made by `mechlab generate --catalog -o models`. Each folder holds MJCF, URDF, JSON, geometry and a sheet. A number from outside "
        "is printed in a source or derived by hand; ours is that of the witness (closed form, Pinocchio, MuJoCo) that is farthest off."
    )
    titles, rule, *lines = markdown(("name", "family", "freedoms", *HEADERS), rows).splitlines()
    by_name = {m[1]: line for line in (*before.splitlines(), *lines) if (m := re.match(r"\| \[(\w+)\]\(", line))}
    return "\n".join([*head, text, "", titles, rule, *(by_name[n] for n in order or by_name if n in by_name)]) + "\n"
