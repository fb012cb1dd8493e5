"""Relations that lock a joint together, against ranks in exact fractions and against the time that dense ones take."""

import time
from collections.abc import Sequence
from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest

from mechlab.errors import MechlabError
from mechlab.mechanism.parts import LinearRelation
from mechlab.mechanism.relation_locks import PRIMES, refuse_locks


def relations(*rows: dict[str, Fraction | int]) -> list[LinearRelation]:
    return [LinearRelation(f"r{k}", tuple((n, Fraction(c)) for n, c in row.items())) for k, row in enumerate(rows)]


def locks(given: list[LinearRelation]) -> bool:
    try:
        refuse_locks("m", given)
    except MechlabError as error:
        assert "together lock joint" in str(error)
        return True
    return False


def dense(rows: int, columns: int) -> list[LinearRelation]:
    """Relations of all joints with coefficients of 17 digits."""
    rng = np.random.default_rng(3)
    return relations(*({f"j{k}": Fraction(repr(float(rng.normal()))) for k in range(columns)} for _ in range(rows)))


def rank(matrix: Sequence[Sequence[int]]) -> int:
    """Rank by elimination in fractions."""
    rows = [[Fraction(int(x)) for x in row] for row in matrix]
    found = 0
    for k in range(len(rows[0])):
        pivot = next((row for row in rows[found:] if row[k]), None)
        if pivot is None:
            continue
        rows.remove(pivot)
        rows.insert(found, pivot)
        found += 1
        rows[found:] = [[a - row[k] / pivot[k] * b for a, b in zip(row, pivot, strict=True)] for row in rows[found:]]
    return found


def test_a_joint_is_locked_where_its_unit_row_is_in_the_span() -> None:
    """The unit row of a joint is in the span when the rank stays the same with it."""
    rng = np.random.default_rng(7)
    seen = set()
    for _ in range(150):
        matrix = rng.integers(-2, 3, (3, 5)) * rng.integers(0, 2, (3, 5))
        rows = [row for row in matrix if np.count_nonzero(row) > 1]
        if not rows:
            continue
        given = relations(*({f"j{k}": int(c) for k, c in enumerate(row) if c} for row in rows))
        expected = any(rank([*rows, unit]) == rank(rows) for unit in np.eye(5, dtype=int))
        assert {locks(list(order)) for order in permutations(given)} == {expected}
        seen.add(expected)
    assert seen == {True, False}


def test_the_message_names_the_relations_that_contradict_each_other_and_no_others() -> None:
    given = relations({"x": 1, "y": 2}, {"a": 1, "b": 2}, {"a": 1, "b": 3})
    with pytest.raises(MechlabError, match=r"'r1', 'r2' together lock joint '[ab]'"):
        refuse_locks("m", given)


def test_a_relation_of_one_joint_locks_it_on_purpose_in_any_order() -> None:
    pair = relations({"a": 1}, {"a": 1, "b": 2})
    refuse_locks("m", pair)
    refuse_locks("m", pair[::-1])


def test_coefficients_that_are_multiples_of_a_prime_do_not_vanish() -> None:
    refuse_locks("m", relations({"a": PRIMES[0], "b": 1}))
    refuse_locks("m", relations({"a": Fraction(1, PRIMES[0]), "b": PRIMES[1]}))


def test_dense_relations_with_many_digits_are_checked_in_seconds() -> None:
    start = time.process_time()
    refuse_locks("m", dense(60, 200))
    assert locks(dense(100, 100))
    # About 0.5 s; with fractions, whose digits grow, 40 relations of 80 joints alone take 4 s.
    assert time.process_time() - start < 10.0


def test_more_terms_than_can_be_checked_are_refused_naming_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mechlab.mechanism.relation_locks.MOST_TERMS", 1000)
    with pytest.raises(MechlabError, match="m: its 20 relations .*limit: 1000 terms.*reached at relation 'r"):
        refuse_locks("m", dense(20, 40))
