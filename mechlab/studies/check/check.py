"""Runs the checks of entries: each with its witnesses, their difference, and whether it passed."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from mechlab.errors import EngineMissing, MechlabError
from mechlab.experiment.entry import Check, CheckResult, Entry
from mechlab.kit.path_motion import keeping
from mechlab.lab.design import Design, reaching
from mechlab.lazy_dataclass import dataclass
from mechlab.progress import counted, silent
from mechlab.results import Shown
from mechlab.studies.check.generic_checks import generic_checks


@dataclass(frozen=True)
class CheckOutcome:
    """One check that ran: `missing` names an engine that is not installed; `error` says why it could not be measured."""

    mechanism: str
    check: Check
    measured: CheckResult | None
    seconds: float
    error: str = ""
    missing: str = ""

    @property
    def passed(self) -> bool:
        """True when it was measured and is within its tolerance."""
        return self.measured is not None and self.measured.passed

    @property
    def verdict(self) -> str:
        """ "pass", "not checked" (an engine is missing) or "FAIL"."""
        return "pass" if self.passed else "not checked" if self.missing else "FAIL"

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        m = self.measured
        return {
            "mechanism": self.mechanism, "id": self.check.id, "text": self.check.text, "source": self.check.source,
            "verdict": self.verdict, "passed": self.passed, "difference": m.difference if m else None,
            "tolerance": m.tolerance if m else None, "witnesses": dict(m.values) if m else {},
            "expected": m.expected if m else None, "note": m.note if m else "", "error": self.error or self.missing,
            "seconds": self.seconds,
        }  # fmt: skip


@dataclass(frozen=True, repr=False)
class CheckReport(Shown):
    """The outcomes of all checks that ran."""

    outcomes: tuple[CheckOutcome, ...]

    @property
    def exit_code(self) -> int:
        """3 when a check failed, else 0."""
        return 3 if any(o.verdict == "FAIL" for o in self.outcomes) else 0

    @property
    def message(self) -> str:
        """One sentence: how many passed, which failed."""
        failed = [f"{o.mechanism} {o.check.id}" for o in self.outcomes if o.verdict == "FAIL"]
        text = f"{sum(o.passed for o in self.outcomes)} of {len(self.outcomes)} checks passed"
        return text + (f"; failed: {', '.join(failed)}" if failed else "")

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {"checks": [o.to_dict() for o in self.outcomes], "message": self.message}


def checks_of(entry: Entry) -> tuple[Check, ...]:
    """The checks of an entry: its own, and the generic ones."""
    return (*entry.checks, *generic_checks(entry))


def run_checks(designs: Sequence[Design], progress: Callable[[int, int], None] = silent) -> CheckReport:
    """Run every check of the designs: their own, and the generic ones. progress: called with (done, total).

    A check that raises MechlabError has failed; one that raises EngineMissing counts as not checked.
    """
    todo = [(design, check) for design in designs for check in checks_of(design.entry)]
    with keeping():
        return CheckReport(tuple(_run(design, check) for design, check in counted(todo, progress)))


def _run(design: Design, check: Check) -> CheckOutcome:
    start = time.perf_counter()
    measured, error, missing = None, "", ""
    try:
        with reaching(design):
            measured = check.run(design.parameters)
    except EngineMissing as cause:
        missing = str(cause)
    except MechlabError as cause:
        error = str(cause)
    return CheckOutcome(design.name, check, measured, time.perf_counter() - start, error, missing)
