"""Functions of x as people write them, such as `x**1.5` or `log10(x)`: arithmetic and the usual functions, nothing else."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import MechlabError

Array = NDArray[np.float64]
FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "exp": np.exp, "log": np.log,
    "ln": np.log, "log10": np.log10, "log2": np.log2, "sqrt": np.sqrt, "abs": np.abs, "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh,
}  # fmt: skip
OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: operator.pow,
    ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip
NAMES = {"pi": np.pi, "e": np.e}
LONGEST = 200
"""Most characters of an expression."""


def function_of_x(text: str) -> Callable[[Array], Array]:
    """The function of a text; ^ means a power. Raises MechlabError for anything but numbers, x, pi, e, + - * / **, and FUNCTIONS."""
    if len(text) > LONGEST:
        raise MechlabError(f"function of x: expected at most {LONGEST} characters, got {len(text)}.")
    try:
        tree = ast.parse(text.replace("^", "**").strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise MechlabError(f"function of x: cannot read {text!r}; write it as x**1.5, log10(x) or sin(pi*x/2).") from None
    _value(tree, np.ones(1), text)

    def function(x: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.asarray(_value(tree, np.asarray(x, dtype=float), text) + np.zeros(np.shape(x)), dtype=float)

    return function


def _value(node: ast.AST, x: Array, text: str) -> Any:
    match node:
        case ast.Constant(value=float() | int() as number) if not isinstance(number, bool):
            return float(number)
        case ast.Name(id="x"):
            return x
        case ast.Name(id=name) if name in NAMES:
            return NAMES[name]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            with np.errstate(all="ignore"):
                return OPERATORS[type(op)](np.asarray(_value(left, x, text)), np.asarray(_value(right, x, text)))
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_value(operand, x, text))
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
            with np.errstate(all="ignore"):
                return FUNCTIONS[name](_value(argument, x, text))
    part = ast.unparse(node)
    raise MechlabError(f"function of x: {part!r} in {text!r} is none of numbers, x, pi, e, + - * / **, {', '.join(FUNCTIONS)}.")
