"""What a linkage does: points, turns, slides and the results of its groups, by name."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mechlab.analytic.assur.dyads import Dyad
from mechlab.analytic.assur.mode_rates import GroupMotion
from mechlab.analytic.assur.plane import Guide, Point, Scalar
from mechlab.errors import NoSolution, unknown


@dataclass
class Motion:
    """All points, turns of links (about their first pin), slides, guides, and the groups' own results, by name."""

    points: dict[str, Point] = field(default_factory=dict)
    turns: dict[str, Scalar] = field(default_factory=dict)
    bases: dict[str, Point] = field(default_factory=dict)
    slides: dict[str, Scalar] = field(default_factory=dict)
    guides: dict[str, Guide] = field(default_factory=dict)
    dyads: dict[str, Dyad] = field(default_factory=dict)
    groups: dict[str, GroupMotion] = field(default_factory=dict)

    def require(self) -> Motion:
        """Itself; raises NoSolution that names the first group which does not assemble or stands at a dead centre."""
        for name, dyad in self.dyads.items():
            try:
                dyad.require()
            except NoSolution as cause:
                raise NoSolution(f"group {name!r}: {cause}") from None
        return self

    def find(self, what: str, name: str) -> Any:
        """A point, link or guide by name; raises MechlabError that lists them."""
        tables: dict[str, dict[str, Any]] = {"point": self.points, "link": self.turns, "guide": self.guides}
        table = tables[what]
        if name not in table:
            raise unknown(f"linkage: {what}", name, table)
        return table[name]
