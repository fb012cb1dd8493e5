"""A verdict follows from the formula behind it: with a wrong formula the ledger says something else."""

from functools import cache

import pytest

from mechlab import catalog
from mechlab.experiment.entry import Claim
from tests.faults.wrong_formulas import (
    SEEDED,
    WrongFormula,
    flipped,
    formulas_behind,
    function_of,
    in_force,
    mutants,
    verdict_of,
)


@cache
def claim(entry: str, id_: str) -> Claim:
    return next(c for c in catalog.entry(entry).claims if c.id == id_)


@cache
def right(entry: str, id_: str) -> str:
    return verdict_of(claim(entry, id_))


@pytest.mark.parametrize("fault", SEEDED, ids=lambda f: f.formula)
def test_the_ledger_flips_with_a_wrong_formula_and_back(fault: WrongFormula) -> None:
    claims = [claim(fault.entry, k) for k in fault.claims]
    before = {c.id: right(fault.entry, c.id) for c in claims}
    assert set(before.values()) <= {"holds", "holds only if", "unreadable in the scan", "misprint, correct is"}
    with in_force(fault):
        assert set(flipped(claims, before)) == set(fault.claims)
    assert flipped(claims, before) == {}


def test_every_entry_of_a_paper_has_a_seeded_formula() -> None:
    papers = {n for n in catalog.NAMES if catalog.entry(n).claims}
    assert papers == {f.entry for f in SEEDED} and len(SEEDED) >= 10


def test_mutants_change_one_operation_each() -> None:
    made = mutants(function_of("differential.train:printed_speeds"))
    assert any("/ (u13 + u46)" in x for x in made) and any("* (u13 - u46)" in x for x in made)
    assert len(set(made)) == len(made) >= 10
    assert "differential.train:printed_speeds" in formulas_behind(claim("closed_differential", "K1"))
