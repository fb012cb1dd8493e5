"""The ledger of printed claims: what a source says, what the witnesses compute, the verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mechlab.experiment.entry import Claim, ClaimResult, Entry, Verdict
from mechlab.experiment.figure import SourceFigure
from mechlab.experiment.publication import Publication
from mechlab.lazy_dataclass import dataclass
from mechlab.progress import counted, silent
from mechlab.results import Shown
from mechlab.studies.check.figures import Drawn, described


@dataclass(frozen=True, repr=False)
class ClaimReport(Shown):
    """Claims with their findings; the figures of the sources that there are, and those that were computed."""

    items: tuple[tuple[str, Claim, ClaimResult], ...]
    available: tuple[tuple[str, SourceFigure], ...] = ()
    figures: tuple[Drawn, ...] = ()
    warnings: tuple[str, ...] = ()
    exit_code: int = 0

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form: {"claims": [{"id", "source", "where", "text", "printed", "computed", "verdict", "kind"}], "sources", "figures"}.

        source: the label of a publication of `sources`; formerly: an older id, where there was one. figures: those that were computed,
        with their readings, else all that there are.
        """
        rows = []
        for mechanism, claim, finding in self.items:
            rows.append(
                {"mechanism": mechanism, "id": claim.id, "source": claim.source.label, "where": claim.where, "text": claim.text,
                 "printed": claim.printed, "computed": finding.computed, "verdict": finding.sentence,
                 "kind": finding.verdict.value} | ({"formerly": claim.formerly} if claim.formerly else {})
            )  # fmt: skip
        sources = [p.to_dict() for p in self.publications]
        known = [x.to_dict() for x in self.figures] or [described(*x) for x in self.available]
        files = [x.file for x in self.figures if x.file]
        made = ({"figure": files[0]} if files else {}) | ({"warnings": list(self.warnings)} if self.warnings else {})
        return {"claims": rows, "sources": sources, "counts": self.counts, "figures": known} | made

    @property
    def publications(self) -> tuple[Publication, ...]:
        """The sources of the claims, each once, in the order of the claims."""
        return tuple(dict.fromkeys(claim.source for _, claim, _ in self.items))

    @property
    def counts(self) -> dict[str, int]:
        """How many claims got which verdict."""
        return {v.value: sum(1 for _, _, f in self.items if f.verdict is v) for v in Verdict}


def run_claims(entries: Sequence[Entry], progress: Callable[[int, int], None] = silent) -> ClaimReport:
    """Test every claim of the entries anew. progress: called with (done, total)."""
    tested = tuple((name, c, c.test()) for name, c in counted([(e.name, c) for e in entries for c in e.claims], progress))
    return ClaimReport(tested, tuple((e.name, f) for e in entries for f in e.figures))
