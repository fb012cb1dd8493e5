"""The ledger of printed claims: what a source says, what the witnesses compute, the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mechlab.experiment.entry import Claim, ClaimResult, Entry, Verdict
from mechlab.results import Shown


@dataclass(frozen=True, repr=False)
class ClaimReport(Shown):
    """Claims with their findings; `figure`: the file of the figure that was drawn, if any."""

    items: tuple[tuple[str, Claim, ClaimResult], ...]
    figure: str = ""
    exit_code: int = 0

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form: {"claims": [{"id", "where", "text", "printed", "computed", "verdict"}]}."""
        rows = []
        for mechanism, claim, finding in self.items:
            rows.append(
                {"mechanism": mechanism, "id": claim.id, "where": claim.where, "text": claim.text, "printed": claim.printed,
                 "computed": finding.computed, "verdict": finding.sentence, "kind": finding.verdict.value}
            )  # fmt: skip
        return {"claims": rows, "counts": self.counts} | ({"figure": self.figure} if self.figure else {})

    @property
    def counts(self) -> dict[str, int]:
        """How many claims got which verdict."""
        return {v.value: sum(1 for _, _, f in self.items if f.verdict is v) for v in Verdict}


def run_claims(entries: Sequence[Entry]) -> ClaimReport:
    """Test every claim of the entries anew."""
    return ClaimReport(tuple((e.name, c, c.test()) for e in entries for c in e.claims))
