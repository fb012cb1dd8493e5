"""Relations whose ratios contradict each other: together they hold a joint still that each of them lets turn."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from mechlab.errors import MechlabError
from mechlab.mechanism.parts import LinearRelation

PRIMES = (2**61 - 1, 2**89 - 1, 2**127 - 1)
MOST_TERMS = 20_000_000
"""Terms that an elimination may touch: about 5 s. 250 relations of the same 250 joints and 4000 in a row are within it."""
MOST_NAMES = 12
"""Relations that the message names."""

Row = dict[str, int]


def refuse_locks(mechanism: str, relations: Sequence[LinearRelation]) -> None:
    """Raise MechlabError if relations of several joints together force the coordinate of one of them to stay zero.

    Homogeneous rows never contradict each other at rest, and they may repeat each other exactly. Meshes whose redundancy is
    inconsistent (one tooth count of a planet mistyped) are found because the unit row of a joint is in their span. A relation
    of one joint locks it on purpose and is left out.

    The reduced row echelon form is computed modulo a prime above 2^60 instead of in fractions, whose digits grow with every
    step: a row that is zero in fractions is zero modulo the prime, and the chance that another one is, is below 1e-11.
    """
    coupled = [r for r in relations if len(r.coefficients) > 1]
    prime = _prime([c for r in coupled for _, c in r.coefficients])
    rows: dict[str, Row] = {}  # by pivot
    sources: dict[str, int] = {}  # by pivot: the relations of a row as bits
    users: dict[str, set[str]] = {}  # by joint: pivots of the rows that name it
    terms = 0
    for bit, relation in enumerate(coupled):
        row = {n: c.numerator * pow(c.denominator, -1, prime) % prime for n, c in relation.coefficients}
        used = 1 << bit
        for pivot in [n for n in row if n in rows]:
            terms += len(rows[pivot])
            _subtract(row, row[pivot], rows[pivot], prime)
            used |= sources[pivot]
        if not row:
            continue
        pivot = min(row, key=lambda n: len(users.get(n, ())))  # the joint that the fewest rows must be cleared of
        inverse = pow(row[pivot], -1, prime)
        row = {n: x * inverse % prime for n, x in row.items()}
        changed = [p for p in users.get(pivot, ()) if pivot in rows[p]]
        for other in changed:
            terms += len(row)
            _subtract(rows[other], rows[other][pivot], row, prime)
            sources[other] |= used
            for n in row:
                users.setdefault(n, set()).add(other)
        rows[pivot], sources[pivot] = row, used
        for n in row:
            users.setdefault(n, set()).add(pivot)
        for joint in [*changed, pivot]:
            if len(rows[joint]) == 1:
                raise _locked(mechanism, joint, [r.name for k, r in enumerate(coupled) if sources[joint] >> k & 1])
        if terms > MOST_TERMS:
            raise MechlabError(
                f"{mechanism}: its {len(coupled)} relations name too many joints in common to be checked against each other "
                f"(limit: {MOST_TERMS} terms in the elimination, reached at relation {relation.name!r}). Leave out relations "
                "that follow from others, or couple each joint to one other joint."
            )


def _prime(coefficients: Sequence[Fraction]) -> int:
    """A prime that divides no numerator and no denominator, so that no coefficient vanishes or is infinite."""
    for prime in PRIMES:
        if all(c.numerator % prime and c.denominator % prime for c in coefficients):
            return prime
    raise MechlabError(f"relations have coefficients that are multiples of {', '.join(map(str, PRIMES))}; use smaller ones.")


def _subtract(row: Row, factor: int, other: Row, prime: int) -> None:
    """row -= factor * other, in place; terms that vanish are removed."""
    for n, x in other.items():
        left = (row.get(n, 0) - factor * x) % prime
        if left:
            row[n] = left
        else:
            row.pop(n, None)


def _locked(mechanism: str, joint: str, relations: Sequence[str]) -> MechlabError:
    meshes = ", ".join(repr(n) for n in sorted(relations)[:MOST_NAMES])
    if len(relations) > MOST_NAMES:
        meshes += f" and {len(relations) - MOST_NAMES} more"
    return MechlabError(
        f"{mechanism}: the relations {meshes} together lock joint {joint!r}: their ratios are inconsistent. "
        "Check the tooth counts of these meshes (ring = sun + 2 planet for a simple planetary stage)."
    )
