"""Printed claims as data: what a source prints, how the witnesses compute it, and the verdict for each comparison.

    LEDGER = Ledger(ZINCHENKO)  # a Publication

    @LEDGER.claim(
        "Z2", "step 2", "37.3 deg = 0.65 rad", 0.65,
        holds(when=below(1e-3, "largest shift*")),
        only_if("{worst:.1g} deg is enough: use the degrees"),
    )
    def rounded_angles() -> Evidence:
        ...
        return evidence({"largest shift of theta2 [deg]": shift, ...}, worst=worst)

The rules are tried in the order in which they are written; the first one whose comparison is true gives the verdict,
and the last one has no comparison. A comparison names values: reported ones (`computed`), or facts, which are not
reported. A `*` in a name stands for any text; then every value with a matching name has to pass.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.experiment.publication import Publication
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

Values = Mapping[str, Any]


@dataclass(frozen=True)
class Evidence:
    """Values that the witnesses computed for a claim (reported), and facts that only comparisons and sentences use."""

    computed: dict[str, Any]
    facts: dict[str, Any]


def evidence(computed: Mapping[str, Any], **facts: Any) -> Evidence:
    """Reported values by a readable name, and facts by an identifier."""
    return Evidence(dict(computed), facts)


def labelled(values: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Values of witnesses with keys such as "numpy: largest difference [m]"."""
    return {f"{witness}: {what}": value for witness, value in values.items()}


# -- comparisons ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Comparison:
    """A condition `test(values, printed)`. Comparisons are combined by & and |, and negated by ~."""

    test: Callable[[Values, Any], bool]

    def __call__(self, values: Values, printed: Any) -> bool:
        """The result of the comparison for these values and this printed number."""
        return self.test(values, printed)

    def __and__(self, other: Comparison) -> Comparison:
        return Comparison(lambda v, p: self(v, p) and other(v, p))

    def __or__(self, other: Comparison) -> Comparison:
        return Comparison(lambda v, p: self(v, p) or other(v, p))

    def __invert__(self) -> Comparison:
        return Comparison(lambda v, p: not self(v, p))


def _named(values: Values, name: str) -> list[Any]:
    """The values of a name, in which * stands for any text. Raises MechlabError when no name matches."""
    if name in values:
        return [values[name]]
    pattern = re.compile(".*".join(map(re.escape, name.split("*"))))
    found = [v for k, v in values.items() if pattern.fullmatch(k)] if "*" in name else []
    if not found:
        raise unknown("value of a claim", name, values)
    return found


def _each(names: tuple[str, ...], test: Callable[[Array], Any]) -> Comparison:
    """True when the test is true for every element of every value of these names."""
    return Comparison(lambda v, p: all(np.all(test(np.asarray(x))) for name in names for x in _named(v, name)))


def _against(name: str, of: Any, test: Callable[[Array, Array], Any]) -> Comparison:
    """True when test(value, reference) is true for all values. of: None for the printed number, a name, or a number."""

    def compare(values: Values, printed: Any) -> bool:
        reference = printed if of is None else _named(values, of)[0] if isinstance(of, str) else of
        return all(np.all(test(np.asarray(x), np.asarray(reference))) for x in _named(values, name))

    return Comparison(compare)


def below(limit: float, *names: str) -> Comparison:
    """Every value is less than the limit; false for NaN."""
    return _each(names, lambda x: x < limit)


def above(limit: float, *names: str) -> Comparison:
    """Every value is greater than the limit; false for NaN."""
    return _each(names, lambda x: x > limit)


def true(*names: str) -> Comparison:
    """Every value is true, or a number other than 0."""
    return _each(names, lambda x: x.astype(bool))


def none(*names: str) -> Comparison:
    """Every value is 0 or false."""
    return _each(names, lambda x: ~x.astype(bool))


def equals(name: str, of: Any = None) -> Comparison:
    """The value is exactly the printed one, or `of`."""
    return _against(name, of, lambda x, y: x == y)


def near(name: str, limit: float, of: Any = None) -> Comparison:
    """The value differs from the printed number (or `of`) by less than the limit (absolute)."""
    return _against(name, of, lambda x, y: np.abs(x - y) < limit)


def factor(name: str, ratio: float, limit: float, of: Any = None) -> Comparison:
    """The value is `ratio` times the printed number (or `of`), within a relative limit."""
    return _against(name, of, lambda x, y: np.abs(x / (ratio * y) - 1.0) < limit)


def shows(name: str, decimals: ArrayLike, of: Any = None) -> Comparison:
    """The value, rounded to the printed number of decimals, equals the printed number (or `of`)."""
    return _against(name, of, lambda x, y: same_digits(x, y, decimals))


def same_digits(value: ArrayLike, printed: ArrayLike, decimals: ArrayLike) -> bool:
    """True when every value, rounded to this number of decimals, equals the printed number."""
    half = 0.5 * 10.0 ** -np.broadcast_to(np.asarray(decimals, dtype=float), np.shape(printed))
    return bool(np.all(np.abs(np.asarray(value) - np.asarray(printed)) <= half * (1.0 + 1e-9)))


# -- verdicts ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rule:
    """A verdict, the words that complete it ({name} is replaced by a fact), and its condition `when` (None: always)."""

    verdict: Verdict
    because: str = ""
    when: Comparison | None = None


def holds(because: str = "", when: Comparison | None = None) -> Rule:
    """Rule: the claim is right as printed."""
    return Rule(Verdict.HOLDS, because, when)


def only_if(because: str, when: Comparison | None = None) -> Rule:
    """Rule: the claim holds only under the condition in `because`."""
    return Rule(Verdict.HOLDS_ONLY_IF, because, when)


def misprint(correct: str, when: Comparison | None = None) -> Rule:
    """Rule: the claim is a misprint; `correct`: the right statement."""
    return Rule(Verdict.MISPRINT, correct, when)


def unreadable(meant: str, when: Comparison | None = None) -> Rule:
    """Rule: the scan is damaged there, so that nothing can be held against the author; `meant`: what must have stood there."""
    return Rule(Verdict.UNREADABLE, meant, when)


def fails(because: str = "", when: Comparison | None = None) -> Rule:
    """Rule: the claim is wrong; `because`: the reason."""
    return Rule(Verdict.FAILS, because, when)


def cannot(because: str, when: Comparison | None = None) -> Rule:
    """Rule: the source does not give what a test of the claim needs; `because`: what is missing."""
    return Rule(Verdict.CANNOT, because, when)


def settle(found: Evidence, printed: Any, rules: tuple[Rule, ...]) -> ClaimResult:
    """The result by the first rule whose comparison is true for the evidence. Raises MechlabError when there is
    none."""
    values = {**found.computed, **found.facts}
    for rule in rules:
        if rule.when is None or rule.when(values, printed):
            return ClaimResult(found.computed, rule.verdict, rule.because.format_map(found.facts))
    raise MechlabError("no verdict of the claim applies; the last one must have no comparison (when=None)")


@dataclass(frozen=True)
class Ledger:
    """The claims of one source, in the order in which they are declared."""

    source: Publication
    entries: list[Claim] = field(default_factory=list)

    @property
    def claims(self) -> tuple[Claim, ...]:
        """All claims declared so far."""
        return tuple(self.entries)

    def claim(
        self, id: str, where: str, text: str, printed: Any, *rules: Rule, formerly: str = ""
    ) -> Callable[[Callable[[], Evidence]], Callable[[], Evidence]]:
        """Decorator that declares a claim; the decorated function computes its evidence at every test of the claim.

        id: unique in the ledger. where: equation, figure or section of the source. printed: the number or words as printed.
        formerly: the id under which earlier versions listed it. Raises MechlabError without a source or a place in it, for
        an id that exists already, and unless exactly the last rule has no comparison.
        """
        if any(id == c.id for c in self.entries):
            raise MechlabError(f"claim {id} is declared twice")
        if not rules or rules[-1].when is not None or any(r.when is None for r in rules[:-1]):
            raise MechlabError(f"claim {id}: the last verdict, and only the last, is given without a comparison")

        def declare(compute: Callable[[], Evidence]) -> Callable[[], Evidence]:
            self.entries.append(
                Claim(id, where, text, printed, lambda: settle(compute(), printed, rules), self.source, formerly)
            )
            return compute

        return declare
