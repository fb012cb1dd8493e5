"""Wrong formulas in `mechlab.analytic`: a formula with one part of its source rewritten, put wherever it is held, and the claims whose
verdict follows."""

from __future__ import annotations
import __future__

import ast
import copy
import inspect
import sys
import textwrap
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import _lru_cache_wrapper
from importlib import import_module
from typing import Any

import numpy as np

from mechlab.experiment.entry import Claim
from tests.faults.hunt import TooLong, limited
from tests.faults.patch import replaced

REFUSED = "refused"
"""In place of a verdict: the claim came to an exception, which `mechlab claims` shows as an error."""
LIMIT = 20.0
"""Seconds of CPU for a claim with a wrong formula behind it."""


@dataclass(frozen=True)
class WrongFormula:
    """A formula of mechlab.analytic, "package.module:function", in whose source `wrong` stands for `right`; `claims` of the entry
    lose their verdict."""

    formula: str
    right: str
    wrong: str
    entry: str
    claims: tuple[str, ...]


SEEDED = (
    WrongFormula("differential.train:printed_speeds", "(u13 - u46)", "(u13 + u46)", "closed_differential", ("K1",)),
    WrongFormula("differential.statics:start_moment", "train.z1 / train.z4", "train.z4 / train.z1", "closed_differential", ("K6",)),
    WrongFormula("differential.statics:start_ratio", "z.z5 / z.z6", "z.z6 / z.z5", "closed_differential", ("K5",)),
    WrongFormula("planetary_synthesis:relative_planet", "- y * t2", "+ y * t2", "planetary", ("Y1",)),
    WrongFormula("planetary_synthesis:ratio_bound_3", "* s - y * t2", "* s + y * t2", "planetary", ("Y4",)),
    WrongFormula("impulse.model:coefficients", "k2 + c2 * cos", "k2 - c2 * cos", "impulse_transmission", ("M1", "M2")),
    WrongFormula("impulse.model:harmonic_amplitudes", "3.0 * s.a5 - s.a6", "3.0 * s.a5 + s.a6", "impulse_transmission", ("M10",)),
    WrongFormula("impulse.model:motor_torque_at", "p.Mn - (", "p.Mn + (", "impulse_transmission", ("M7",)),
    WrongFormula("impulse.regime:phases", "(1.0 - ratio)", "(1.0 + ratio)", "impulse_transmission", ("M8",)),
    WrongFormula("impulse.clutch:clutched", "resisting * mean / speed", "resisting * speed / mean", "impulse_transmission", ("M17",)),
    WrongFormula("gear_linkage.knife:engagement", "0.5 * inertia", "inertia", "gear_linkage", ("G10",)),
    WrongFormula("gear_linkage.linkage:rolling_rates", "first - b) - vc", "first - b) + vc", "gear_linkage", ("G1", "G2")),
    WrongFormula("assur.dyads:rrr", "x = (safe +", "x = (safe -", "class4_linkage", ("Z5", "Z7")),
    WrongFormula("transition_matrices.tree:joint_motion", "unit + angle", "unit - angle", "prosthetic_leg", ("T1", "T2")),
    WrongFormula("delta6.rotation:_signed", "[k_alpha, -k_beta", "[-k_alpha, -k_beta", "delta6", ("C30",)),
    WrongFormula("delta6.translation:translation_jacobian", "inverse = -1.0", "inverse = 1.0", "delta6", ("C27",)),
    WrongFormula("delta6.mesh:sliding_velocity", "wb = -(wa + wc)", "wb = -(wa - wc)", "delta6", ("C38",)),
    WrongFormula("delta6.mesh:tip_distance", "sqrt((r + module)", "sqrt((r + 1.25 * module)", "delta6", ("C38",)),
    WrongFormula("delta6.control:error_response", "np.where(over, slow, -a)", "np.where(over, -slow, a)", "delta6", ("C36",)),
    WrongFormula("delta6.control:source_targets", "-5.0 * s5", "5.0 * s5", "delta6", ("C37",)),
    WrongFormula("delta6.mesh:contact_levers", "(tangent - s /", "(tangent + s /", "delta6", ("C46",)),
    WrongFormula("differential.converter:converter_state", "1.0 - n * n", "1.0 - n", "closed_differential", ("L8",)),
    WrongFormula("gear_linkage.knife:crank_inertia", "ends / 3.0", "ends / 2.0", "gear_linkage", ("G10",)),
    WrongFormula("transition_matrices.lagrange:_bias", "before @ twice[..., i, :, :]", "twice[..., i, :, :] @ before", "prosthetic_leg",
                 ("T3",)),
    WrongFormula("bspline.length:simpson_spans", "= 4.0, 2.0", "= 2.0, 4.0", "delta6", ("C49",)),
    WrongFormula("regions:_lower", "np.minimum", "np.maximum", "delta6", ("C53",)),
)  # fmt: skip
"""Written by hand: a sign, a factor, a wheel taken for another, tip and root exchanged."""


def function_of(formula: str) -> Any:
    """The function "package.module:name" of mechlab.analytic."""
    module, _, name = formula.partition(":")
    return getattr(import_module(f"mechlab.analytic.{module}"), name)


def rewritten(function: Any, source: str) -> Any:
    """The function with another source text, in a copy of its module's names."""
    plain = function.__wrapped__ if isinstance(function, _lru_cache_wrapper) else function
    names = dict(vars(sys.modules[plain.__module__]))
    code = compile(source, f"<wrong {plain.__name__}>", "exec", flags=__future__.annotations.compiler_flag, dont_inherit=True)
    exec(code, names)
    return names[plain.__name__]


def source_of(function: Any) -> str:
    """Its source text, not indented."""
    return textwrap.dedent(inspect.getsource(function))


@contextmanager
def in_force(fault: WrongFormula) -> Iterator[None]:
    """Within the block the wrong formula stands everywhere. Raises AssertionError where the source has no such part, or more."""
    function = function_of(fault.formula)
    source = source_of(function)
    assert source.count(fault.right) == 1, f"{fault.formula} has {source.count(fault.right)} times {fault.right!r}"
    wrong = rewritten(function, source.replace(fault.right, fault.wrong))
    with replaced(function, lambda _: wrong) as places:
        assert places, f"nothing holds {fault.formula}"
        yield


def verdict_of(claim: Claim) -> str:
    """The verdict of a claim tested now; REFUSED where it raises, or takes longer than LIMIT."""
    return finding_of(claim)[0]


def finding_of(claim: Claim) -> tuple[str, str, str]:
    """The verdict as `verdict_of`, its sentence, and the numbers that are computed, to nine digits."""
    try:
        with limited(LIMIT):
            found = claim.test()
    except (Exception, TooLong) as error:  # whatever a wrong formula leads to is seen by the user of `claims`
        return REFUSED, type(error).__name__, ""
    said = {k: np.round(np.asarray(v, dtype=float), 9).tolist() for k, v in found.computed.items() if np.asarray(v).dtype.kind in "bif"}
    return found.verdict.value, found.sentence, str(said)


# -- mutants -------------------------------------------------------------------------------------------------------------

OTHER: Mapping[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Lt: ast.Gt, ast.Gt: ast.Lt,
}  # fmt: skip
TURNED = {"sin": "cos", "cos": "sin", "tan": "sin", "hypot": "arctan2", "minimum": "maximum", "maximum": "minimum"}


def _changes(tree: ast.AST) -> list[Callable[[], None]]:
    """Every single change of the arithmetic of a parsed function, as a function that makes it in the tree."""
    out: list[Callable[[], None]] = []
    silent = {id(x) for node in ast.walk(tree) if isinstance(node, ast.Raise | ast.JoinedStr | ast.Assert) for x in ast.walk(node)}
    body = tree.body[0]  # type: ignore[attr-defined]
    silent |= {id(x) for part in (body.args, *filter(None, [body.returns])) for x in ast.walk(part)}

    def swap(node: ast.BinOp) -> Callable[[], None]:
        return lambda: setattr(node, "op", OTHER[type(node.op)]())

    def turn(node: ast.Attribute) -> Callable[[], None]:
        return lambda: setattr(node, "attr", TURNED[node.attr])

    def half_more(node: ast.Constant) -> Callable[[], None]:
        return lambda: setattr(node, "value", 1.5 * node.value)  # type: ignore[operator]

    def unsigned(node: ast.UnaryOp) -> Callable[[], None]:
        return lambda: setattr(node, "op", ast.UAdd())

    for node in ast.walk(tree):
        if id(node) in silent:
            continue
        if isinstance(node, ast.BinOp) and type(node.op) in OTHER:
            out.append(swap(node))
        elif isinstance(node, ast.Attribute) and node.attr in TURNED and ast.unparse(node.value) in ("np", "math"):
            out.append(turn(node))
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and not isinstance(node.operand, ast.Constant):
            out.append(unsigned(node))
        elif isinstance(node, ast.Constant) and isinstance(node.value, float) and 1e-3 < abs(node.value) < 1e3:
            out.append(half_more(node))
    return out


def mutants(function: Any) -> list[str]:
    """Sources of the function with one operation, sign, constant or trigonometric function changed."""
    tree = ast.parse(source_of(function))
    out = []
    for k in range(len(_changes(tree))):
        changed = copy.deepcopy(tree)
        _changes(changed)[k]()
        out.append(ast.unparse(changed))
    return out


def formulas_behind(claim: Claim) -> set[str]:
    """The functions of mechlab.analytic ("package.module:name") that run while the claim is tested."""
    seen: set[tuple[str, str]] = set()

    def look(frame: types.FrameType, event: str, _: Any) -> None:
        if event == "call":
            module = frame.f_globals.get("__name__", "")
            if module.startswith("mechlab.analytic."):
                seen.add((module.removeprefix("mechlab.analytic."), frame.f_code.co_qualname))

    sys.setprofile(look)
    try:
        claim.test()
    finally:
        sys.setprofile(None)
    return {f"{module}:{name}" for module, name in seen if "." not in name and not name.startswith("<")}


def flipped(claims: Sequence[Claim], before: Mapping[str, str]) -> dict[str, str]:
    """The claims whose verdict is another than before, with what it is now."""
    now = {claim.id: verdict_of(claim) for claim in claims}
    return {k: v for k, v in now.items() if v != before[k]}
