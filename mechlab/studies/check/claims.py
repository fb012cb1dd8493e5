"""The ledger of printed claims: what a source says, what the witnesses compute, the verdict; and the figure of the source."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError
from mechlab.experiment.entry import Claim, ClaimResult, Entry, Verdict
from mechlab.experiment.publication import Publication
from mechlab.files import unfinished
from mechlab.results import Shown


@dataclass(frozen=True, repr=False)
class ClaimReport(Shown):
    """Claims with their findings; `figure`: the file of the figure that was drawn, if any."""

    items: tuple[tuple[str, Claim, ClaimResult], ...]
    figure: str = ""
    exit_code: int = 0

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form: {"claims": [{"id", "source", "where", "text", "printed", "computed", "verdict", "kind"}], "sources"}.

        source: the label of a publication of `sources`; formerly: an older id, where there was one.
        """
        rows = []
        for mechanism, claim, finding in self.items:
            rows.append(
                {"mechanism": mechanism, "id": claim.id, "source": claim.source.label, "where": claim.where, "text": claim.text,
                 "printed": claim.printed, "computed": finding.computed, "verdict": finding.sentence,
                 "kind": finding.verdict.value} | ({"formerly": claim.formerly} if claim.formerly else {})
            )  # fmt: skip
        sources = [p.to_dict() for p in self.publications]
        return {"claims": rows, "sources": sources, "counts": self.counts} | ({"figure": self.figure} if self.figure else {})

    @property
    def publications(self) -> tuple[Publication, ...]:
        """The sources of the claims, each once, in the order of the claims."""
        return tuple(dict.fromkeys(claim.source for _, claim, _ in self.items))

    @property
    def counts(self) -> dict[str, int]:
        """How many claims got which verdict."""
        return {v.value: sum(1 for _, _, f in self.items if f.verdict is v) for v in Verdict}


def run_claims(entries: Sequence[Entry]) -> ClaimReport:
    """Test every claim of the entries anew."""
    return ClaimReport(tuple((e.name, c, c.test()) for e in entries for c in e.claims))


SUFFIXES = (".png", ".svg", ".pdf")


def write_figure(entries: Sequence[Entry], path: str | Path) -> Path:
    """Draw the figure of the one entry that has one to `path` (.png, .svg or .pdf).

    Raises MechlabError for another suffix, and when not exactly one of the entries has a figure.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise MechlabError(f"figure {target}: expected a name that ends in {', '.join(SUFFIXES)}.")
    able = [e for e in entries if e.figure is not None]
    if len(able) != 1 or able[0].figure is None:
        names = ", ".join(e.name for e in able) or "none"
        raise MechlabError(
            f"a figure is drawn for one mechanism; of {', '.join(e.name for e in entries)} these have one: {names}. "
            "Name that one."
        )
    with unfinished(target) as temporary:
        able[0].figure(temporary)
    return target
