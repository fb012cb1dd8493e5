"""The question `regions`: is a point inside a region that is put together from functions f, g, h, k by & (and), | (or), ~ (not)?

A function says inside where it is >= 0. Two things are compared at each point: `inside`, what the functions say when `not` is a
change of sign, and `inside_by_law`, what Boolean algebra says of chi(f) = 1 where f >= 0, else 0, with chi(-f) = not chi(f), as the
paper prints it. They part on borders, where a function is 0 and both it and its negative say inside; `broken` counts these points.
Three witnesses: min and max, R-functions, and sets (negations moved to the functions, f >= 0 or f <= 0 there).
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic.regions import EXACT, SMOOTH, Algebra, FloatArray, indicator
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.question import Answer, Answers, Question
from mechlab.lazy_dataclass import dataclass
from mechlab.studies.direct.keys import known_keys, number_of

NAME = "regions"
FUNCTIONS = ("f", "g", "h", "k")
LAW_ON_TRIAL = "~f"
LONGEST = 200
"""Characters of an expression."""
EXAMPLE = 'region="f & ~g" f=-1,0,1 g=1,1,0'


@dataclass(frozen=True)
class Formula:
    """A region of functions, read: the tree of its operations, and the functions that it names."""

    text: str
    tree: ast.expr
    names: tuple[str, ...]

    def fold(self, leaf: Callable[[str], Any], both: Callable[[Any, Any], Any], either: Callable[[Any, Any], Any],
             negative: Callable[[Any], Any]) -> Any:  # fmt: skip
        """The value of the tree with these meanings of a function, &, | and ~."""

        def value(node: ast.expr) -> Any:
            if isinstance(node, ast.Name):
                return leaf(node.id)
            if isinstance(node, ast.UnaryOp):
                return negative(value(node.operand))
            assert isinstance(node, ast.BinOp)
            join = both if isinstance(node.op, ast.BitAnd) else either
            return join(value(node.left), value(node.right))

        return value(self.tree)


def read_formula(text: str) -> Formula:
    """A region such as "f & ~(g | h)". Raises MechlabError that names what does not belong into one."""
    if len(text) > LONGEST:
        raise MechlabError(f"{NAME}: region: {len(text)} characters; expected at most {LONGEST}.")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError):
        raise MechlabError(f"{NAME}: region = {text!r}: expected {', '.join(FUNCTIONS)} joined by &, | and ~, as in {EXAMPLE}.") from None
    names = []
    for node in (n for n in ast.walk(tree) if isinstance(n, ast.expr)):
        joins = isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitAnd | ast.BitOr)
        negates = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Invert)
        if isinstance(node, ast.Name):
            if node.id not in FUNCTIONS:
                raise unknown(f"{NAME}: region: function", node.id, FUNCTIONS)
            names.append(node.id)
        elif not joins and not negates:
            part = ast.get_source_segment(text.strip(), node)
            raise MechlabError(f"{NAME}: region: {part!r} is no function, nor functions joined by &, | and ~, as in {EXAMPLE}.")
    return Formula(text, tree, tuple(sorted(set(names))))


def solve_regions(values: Mapping[str, Any]) -> Answers:
    """The answers to region=EXPRESSION f=... [g=... h=... k=...], numbers or lists of them; without region, "~f".

    Raises MechlabError for an unknown key, an expression that is none, and functions without values or of unequal lengths.
    """
    known_keys(NAME, values, ("region", *FUNCTIONS))
    formula = read_formula(str(values.get("region", LAW_ON_TRIAL)))
    missing = [k for k in formula.names if k not in values]
    if missing:
        raise MechlabError(f"{NAME}: {' and '.join(missing)} missing; give values of the functions at points, as in {EXAMPLE}.")
    unused = [k for k in FUNCTIONS if k in values and k not in formula.names]
    if unused:
        raise MechlabError(f"{NAME}: {' and '.join(unused)} given, but the region {formula.text!r} does not name it.")
    numbers = {k: number_of(NAME, k, values[k], "", True) for k in formula.names}
    try:
        np.broadcast_shapes(*(np.shape(x) for x in numbers.values()))
    except ValueError:
        sizes = ", ".join(f"{k}: {np.size(x)}" for k, x in numbers.items())
        raise MechlabError(f"{NAME}: the functions have values at unequal numbers of points ({sizes}).") from None
    answers = {who: ask(formula, numbers) for who, ask in QUESTION.witnesses.items()}
    if "region" not in values:
        first = next(iter(answers))
        answers[first] = replace(answers[first], notes=(f"the region is {LAW_ON_TRIAL}, as none is given", *answers[first].notes))
    return Answers(QUESTION.name, answers, units=QUESTION.units, parameters={"region": formula.text}, given=numbers)


def _by_algebra(algebra: Algebra, what: str) -> Callable[[Formula, Mapping[str, Any]], Answer]:
    """The witness that composes the functions by an algebra; `what`: the name of the value of the whole."""

    def witness(formula: Formula, given: Mapping[str, Any]) -> Answer:
        points = {k: np.asarray(v, dtype=float) for k, v in given.items()}
        value: FloatArray = np.asarray(formula.fold(points.__getitem__, algebra.meet, algebra.join, np.negative))
        by_law = formula.fold(
            lambda k: indicator(points[k]), lambda a, b: 1 * (algebra.meet(a, b) > 0.0), lambda a, b: 1 * (algebra.join(a, b) > 0.0),
            lambda a: 1 - a,
        )  # fmt: skip
        return _answer(indicator(value) == 1, by_law == 1, {what: value})

    return witness


def _sets(formula: Formula, given: Mapping[str, Any]) -> Answer:
    """The witness of sets: each point belongs to the set of a function and to that of its negative by comparisons alone."""
    points = {k: np.asarray(v, dtype=float) for k, v in given.items()}

    def swap(pair: Any) -> Any:
        return pair[1], pair[0]

    def pairs(negative_of: Callable[[FloatArray], Any]) -> Any:
        """(in the set, in its negative) of the whole, De Morgan's laws taking the negation down to the functions."""
        return formula.fold(
            lambda k: (points[k] >= 0.0, negative_of(points[k])), lambda a, b: (a[0] & b[0], a[1] | b[1]),
            lambda a, b: (a[0] | b[0], a[1] & b[1]), swap,
        )[0]  # fmt: skip

    return _answer(pairs(lambda x: x <= 0.0), pairs(lambda x: x < 0.0), {})


def _answer(inside: Any, by_law: Any, more: Mapping[str, Any]) -> Answer:
    """The answer, and in words where the printed law does not hold."""
    inside, by_law = np.broadcast_arrays(np.asarray(inside), np.asarray(by_law))
    broken = int(np.count_nonzero(inside != by_law))
    values = {"inside": inside.astype(float), "inside_by_law": by_law.astype(float), "broken": float(broken), **more}
    notes = (f"chi(-f) = not chi(f) does not hold at {broken} of {inside.size} points: they lie on a border",) if broken else ()
    return Answer({k: float(v) if np.ndim(v) == 0 else v for k, v in values.items()}, notes=notes)


QUESTION = Question(
    NAME, ("f",), ("inside", "inside_by_law", "broken", "margin", "r_function"),
    {"min and max": _by_algebra(EXACT, "margin"), "R-functions": _by_algebra(SMOOTH, "r_function"), "sets": _sets},
    dict.fromkeys(("region", "g", "h", "k")),
    units=dict.fromkeys(("inside", "inside_by_law", "broken", "margin", "r_function", "region", *FUNCTIONS), ""),
    text="whether points lie in a region of functions (inside where f >= 0) joined by & | ~, the border included; and whether the printed "
    "law chi(-f) = not chi(f) says the same",
)  # fmt: skip
