"""Every comparison of a claim gives the other verdict when the printed number, or what is computed, is another."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mechlab.errors import MechlabError
from mechlab.experiment.entry import Verdict
from mechlab.experiment.publication import Publication
from mechlab.kit.claims import (
    Comparison,
    Evidence,
    Ledger,
    above,
    below,
    cannot,
    equals,
    evidence,
    factor,
    fails,
    holds,
    misprint,
    near,
    none,
    only_if,
    shows,
    true,
    unreadable,
)

SOURCE = Publication("Euclid", "Elements")


def verdict(comparison: Comparison, printed: Any, computed: dict[str, Any], **facts: Any) -> Verdict:
    ledger = Ledger(SOURCE)

    @ledger.claim("A1", "page 1", "text", printed, holds(when=comparison), fails("another number"))
    def compute() -> Evidence:
        return evidence(computed, **facts)

    return ledger.claims[0].test().verdict


PI = {"pinocchio: pi": np.pi}


@pytest.mark.parametrize(
    ("comparison", "right", "wrong"),
    [
        (shows("pinocchio: pi", 2), 3.14, 3.15),
        (shows("pinocchio: pi", 4), 3.1416, 3.1415),
        (near("pinocchio: pi", 1e-2), 3.14, 3.12),
        (equals("pinocchio: pi"), np.pi, 3.14159265),
        (factor("pinocchio: pi", 0.5, 1e-9), 2.0 * np.pi, 2.01 * np.pi),
        (~near("* pi", 1.0), 1.0, 3.0),
        (near("* pi", 1.0) & shows("* pi", 1), 3.1, 3.0),
        (near("* pi", 0.2) | equals("* pi"), 3.0, 2.0),
    ],
)
def test_another_printed_number_gives_the_other_verdict(comparison: Comparison, right: Any, wrong: Any) -> None:
    assert verdict(comparison, right, PI) is Verdict.HOLDS
    assert verdict(comparison, wrong, PI) is Verdict.FAILS


@pytest.mark.parametrize(
    ("comparison", "right", "wrong"),
    [
        (below(1e-3, "*"), [1e-4, 2e-4], [1e-4, 2e-3]),
        (below(1e-3, "*"), 0.0, float("nan")),
        (above(1.0, "*"), [1.1, 2.0], [0.9, 2.0]),
        (above(1.0, "*"), 2.0, float("nan")),
        (true("*"), [1, 3], [1, 0]),
        (none("*"), [0, 0], [0, 2]),
    ],
)
def test_another_computed_number_gives_the_other_verdict(comparison: Comparison, right: Any, wrong: Any) -> None:
    assert verdict(comparison, None, {"x": right}) is Verdict.HOLDS
    assert verdict(comparison, None, {"x": wrong}) is Verdict.FAILS
    assert verdict(comparison, None, {"x": right, "y": wrong}) is Verdict.FAILS  # every value of a name with *


def test_a_reference_may_be_a_value_or_a_number() -> None:
    assert verdict(near("x", 0.1, of="y"), None, {"x": 1.0}, y=1.05) is Verdict.HOLDS
    assert verdict(near("x", 0.1, of="y"), None, {"x": 1.0}, y=1.2) is Verdict.FAILS
    assert verdict(equals("x", 2), None, {"x": 2}) is Verdict.HOLDS


def test_first_verdict_that_applies_and_its_sentence() -> None:
    def told(x: float) -> str:
        ledger = Ledger(SOURCE)
        ledger.claim(
            "A1", "page 1", "text", 1.0, holds(when=near("x", 0.1)), only_if("x is {double:.1f} / 2", when=near("x", 1.0)),
            misprint("{double:g}", when=below(10.0, "x")), cannot("x is too large"),
        )(lambda: evidence({"x": x}, double=2.0 * x))  # fmt: skip
        finding = ledger.claims[0].test()
        assert finding.computed == {"x": x}  # facts are not reported
        return finding.sentence

    assert told(1.05) == "holds"
    assert told(1.5) == "holds only if x is 3.0 / 2"
    assert told(5.0) == "misprint, correct is 10"
    assert told(50.0) == "cannot be checked: x is too large"


def test_a_claim_without_a_last_word_and_one_declared_twice_are_refused() -> None:
    ledger = Ledger(SOURCE)
    with pytest.raises(MechlabError, match="A1: the last verdict"):
        ledger.claim("A1", "page 1", "text", 1, holds(when=true("x")))
    with pytest.raises(MechlabError, match="only the last"):
        ledger.claim("A1", "page 1", "text", 1, holds(), fails())
    ledger.claim("A1", "page 1", "text", 1, holds())(lambda: evidence({}))
    with pytest.raises(MechlabError, match="declared twice"):
        ledger.claim("A1", "page 1", "text", 1, holds())


def test_a_claim_without_a_source_or_a_place_in_it_is_refused() -> None:
    with pytest.raises(MechlabError, match="B1: it has no source"):
        Ledger("Euclid").claim("B1", "page 1", "text", 1, holds())(lambda: evidence({}))  # type: ignore[arg-type]
    with pytest.raises(MechlabError, match="B1: where does Euclid print it"):
        Ledger(SOURCE).claim("B1", " ", "text", 1, holds())(lambda: evidence({}))
    with pytest.raises(MechlabError, match="a label and a title"):
        Publication("Euclid", "")


def test_what_the_scan_hides_is_neither_a_misprint_nor_wrong() -> None:
    ledger = Ledger(SOURCE)
    ledger.claim("A1", "page 1", "text", 108.0, holds(when=equals("x")), unreadable("{x:g}, the comma is lost"))(
        lambda: evidence({"x": 1.08}, x=1.08)
    )
    assert ledger.claims[0].test().sentence == "unreadable in the scan: 1.08, the comma is lost"


def test_a_name_that_nothing_has_is_an_error() -> None:
    with pytest.raises(MechlabError, match="largest misfit"):
        verdict(below(1.0, "largest misfit"), None, {"largest gap": 0.5})
