"""All claims of the catalog: where each is printed, and that no two share a name."""

from collections import Counter

import pytest

from mechlab import catalog
from mechlab.api.models import claims, show
from mechlab.catalog.bibliography import BIBLIOGRAPHY
from mechlab.experiment.entry import Claim, Entry

SOURCED = ("closed_differential", "planetary", "impulse_transmission", "gear_linkage", "class4_linkage", "prosthetic_leg", "delta6")
"""Entries that stand on a paper."""
CLAIMS: dict[str, tuple[Claim, ...]] = {name: catalog.entry(name).claims for name in SOURCED}


def test_a_mechanism_of_no_source_says_so() -> None:
    report = claims("fourbar")
    assert report.exit_code == 0 and not report.items
    assert "No claims of a source" in report.text() and "no claims" in repr(report)


def test_no_two_claims_have_one_id() -> None:
    ids = Counter(c.id for group in CLAIMS.values() for c in group)
    assert sum(ids.values()) > 110
    assert [k for k, n in ids.items() if n > 1] == []


def test_every_claim_names_a_paper_of_the_bibliography_and_a_place_in_it() -> None:
    used = {c.source for group in CLAIMS.values() for c in group}
    assert used == set(BIBLIOGRAPHY)  # nothing else is cited, and nothing is listed for show
    assert len({p.label for p in BIBLIOGRAPHY}) == len(BIBLIOGRAPHY)


@pytest.mark.parametrize("name", SOURCED)
def test_the_sheet_cites_the_papers_of_the_claims(name: str) -> None:
    entry: Entry = catalog.entry(name)
    cited = {c.source.citation for c in entry.claims}
    assert cited <= set(entry.sources) and cited <= set(show(name).data["sources"])


def test_text_and_json_say_where_a_claim_is_printed() -> None:
    report = claims("planetary")
    document = report.to_dict()
    (paper,) = document["sources"]
    assert "Beresh" in paper["authors"] and paper["year"] == 2009 and "2A-AA" in paper["title"]
    assert [(c["source"], c["where"]) for c in document["claims"][:2]] == [
        (paper["label"], "equation (5)"), (paper["label"], "inequality (9)"),
    ]  # fmt: skip
    assert f"planetary Y1 ({paper['label']}, equation (5))" in str(report)
    assert "Beresh" in str(report).split("Sources\n")[1]
    (first, *_) = claims("prosthetic_leg").to_dict()["claims"]
    assert (first["id"], first["formerly"]) == ("T1", "G1")  # two entries had G1 to G6
