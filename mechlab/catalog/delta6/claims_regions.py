"""Claims of an article on Boolean algebras of continuous functions, by which workspaces are put together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mechlab.analytic.regions import EXACT, SMOOTH, Algebra, indicator
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.mechanism.geometry import Array

SOURCE = "Boolean algebras on the basis of continuous and continuously differentiable functions"
CASES = 200_000


def _values() -> tuple[Array, Array, Array]:
    """Random values of three functions; a tenth of them 0, where the border is."""
    rng = np.random.default_rng(7)
    values = rng.standard_normal((3, CASES))
    values[rng.random(values.shape) < 0.1] = 0.0
    return values[0], values[1], values[2]


def characteristic() -> ClaimResult:
    """chi(f) = (1 + sgn f) / 2 as numbers."""
    x, _, _ = _values()
    plain = (1.0 + np.sign(x)) / 2.0
    computed = {
        "values with sgn 0 = 0": sorted({float(v) for v in plain}),
        "values with sgn 0 = 1": sorted({float(v) for v in indicator(x)}),
    }
    if computed["values with sgn 0 = 0"] == [0.0, 1.0]:
        return ClaimResult(computed, Verdict.HOLDS)
    if computed["values with sgn 0 = 1"] == [0.0, 1.0]:
        return ClaimResult(
            computed, Verdict.HOLDS_ONLY_IF, "sgn 0 is taken as +1; with sgn 0 = 0 it gives 1/2 on the border"
        )
    return ClaimResult(computed, Verdict.FAILS, "more than two values")


def _laws(form: Algebra, x: Array, y: Array, z: Array) -> Iterator[tuple[str, Array, Array]]:
    a, o = form.meet, form.join
    yield "commutative", a(x, y), a(y, x)
    yield "associative", a(a(x, y), z), a(x, a(y, z))
    yield "distributive", a(x, o(y, z)), o(a(x, y), a(x, z))
    yield "absorption", o(x, a(x, y)), x
    yield "idempotent", a(x, x), x
    yield "De Morgan", -a(x, y), o(-x, -y)


def boolean_algebra() -> ClaimResult:
    """The laws of a Boolean algebra on signs, with min and max and with R-functions; and the complement on the border."""
    x, y, z = _values()
    computed: dict[str, object] = {}
    wrong = 0
    for form in (EXACT, SMOOTH):
        signs = sum(int(np.count_nonzero(indicator(p) != indicator(q))) for _, p, q in _laws(form, x, y, z))
        values = max(float(np.max(np.abs(p - q))) for _, p, q in _laws(form, x, y, z))
        computed |= {f"{form.name}: signs that break a law": signs, f"{form.name}: largest difference in value": values}
        wrong += signs
    both = int(np.count_nonzero(indicator(x) + indicator(-x) == 2))
    computed |= {"points of f and of not f": both, "points with f = 0": int(np.count_nonzero(x == 0.0))}
    if wrong:
        return ClaimResult(computed, Verdict.FAILS, f"{wrong} signs break a law")
    if both == 0:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed, Verdict.HOLDS_ONLY_IF,
        "sets are counted alike that differ on the border f = 0: {f >= 0} is closed, {-f >= 0} is too, and both have the border; "
        "the complement of a closed set is open",
    )  # fmt: skip


def smooth_algebra() -> ClaimResult:
    """Continuously differentiable operations: one-sided slopes of the R-function and of min across the line x = y."""
    h = 1e-7
    x = np.linspace(0.1, 3.0, 50)
    jump = {
        form.name: float(np.max(np.abs((form.meet(x + h, x) - 2 * form.meet(x, x) + form.meet(x - h, x)) / h)))
        for form in (EXACT, SMOOTH)
    }
    corner = [float(SMOOTH.meet(s * h, 0.0)) / h for s in (1.0, -1.0)]
    computed: dict[str, object] = {f"{k}: jump of the slope where f = g": v for k, v in jump.items()}
    computed["R_0: slopes to both sides where f = g = 0"] = [corner[0], -corner[1]]
    if jump[SMOOTH.name] > 1e-3:
        return ClaimResult(computed, Verdict.FAILS, "the slope jumps")
    if abs(corner[0] + corner[1]) < 1e-6:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed, Verdict.HOLDS_ONLY_IF,
        "corners are left out: where both functions vanish the slope of an R-function jumps as that of min does",
    )  # fmt: skip


CLAIMS = (
    Claim("C52", "characteristic of a function",
          "chi(f) = (1 + sgn f) / 2 is a two-valued variable, 1 where f >= 0 and 0 elsewhere.", "{0, 1}", characteristic, SOURCE),
    Claim("C53", "abstract, continuous functions",
          "On the classes of continuous functions with the same sign a Boolean algebra can be built that is isomorphic to the "
          "algebra of sets.", "isomorphic", boolean_algebra, SOURCE),
    Claim("C54", "abstract, continuously differentiable functions",
          "The same can be done with continuously differentiable functions.", "isomorphic", smooth_algebra, SOURCE),
)  # fmt: skip
