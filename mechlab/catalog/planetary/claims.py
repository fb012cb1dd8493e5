"""Claims of the source on the synthesis of planetary gears with series planets."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from mechlab.analytic import planetary_synthesis as closed_form
from mechlab.catalog.bibliography import PLANETARY
from mechlab.kit.claims import Evidence, Ledger, above, below, evidence, fails, holds, near, none, only_if, unreadable

LEDGER = Ledger(PLANETARY)
CASES = 200_000


@lru_cache(maxsize=1)
def _cases() -> tuple[np.ndarray, ...]:
    """Random ratios, y, t1, t2, planets inside the recommended ranges and the conditions of existence (6)."""
    rng = np.random.default_rng(6)
    n = 2 * CASES
    values = (
        rng.uniform(1.05, 15.0, n), rng.uniform(0.2, 3.0, n), rng.uniform(0.8, 1.2, n), rng.uniform(0.8, 1.2, n),
        rng.integers(3, 7, n),
    )  # fmt: skip
    ok = closed_form.exists(*values[:4])
    return tuple(x[ok][:CASES] for x in values)


@LEDGER.claim(
    "Y1", "equation (5)", "z2 from z1, the ratio, y, t1, t2", "(5)",
    holds(when=below(1e-12, "largest residual of (2), relative")),
    fails("(5) does not solve (2)"),
)  # fmt: skip
def planet_formula() -> Evidence:
    """(5) put back into the condition of one ray (2)."""
    i, y, t1, t2, _ = _cases()
    two = closed_form.relative_planet(i, y, t1, t2)
    residual = 1.0 + two + (two + y * two) * t1 - (y * two + i - 1.0) * t2
    worst = float(np.max(np.abs(residual) / (1.0 + np.abs(two) * (1.0 + y))))
    return evidence({"largest residual of (2), relative": worst, "cases": len(i)})


@LEDGER.claim(
    "Y2", "inequality (9)", "upper bound of the ratio from neighbouring planets 2", "denominator 1 - t2 s",
    holds(when=none("mismatches of the printed bound")),
    fails("the denominator must be t2 (1 - s); the two agree for t2 = 1. It is no slip of the pen: (10) is derived from it",
          when=none("mismatches of the corrected bound")),
    fails("neither form is the bound"),
)  # fmt: skip
def upper_bound() -> Evidence:
    """(9) as printed and corrected, against the neighbour condition (8) itself."""
    i, y, t1, t2, k = _cases()
    truth = closed_form.neighbours_direct(i, y, t1, t2, k)[0]
    printed = (i < closed_form.ratio_bound_2(y, t1, t2, k, printed=True)) != truth
    corrected = (i < closed_form.ratio_bound_2(y, t1, t2, k)) != truth
    example = [float(closed_form.ratio_bound_2(1.0, 1.0, 1.1, 3, printed=flag)) for flag in (True, False)]
    return evidence({
        "mismatches of the printed bound": int(printed.sum()), "mismatches of the corrected bound": int(corrected.sum()),
        "cases": len(i), "k = 3, y = 1, t1 = 1, t2 = 1.1: printed, corrected": example,
    })  # fmt: skip


@LEDGER.claim(
    "Y3", "inequality (10)", "t2 must stay below 1 / sin(pi / k), 1.15 for three planets", 1.15,
    holds(when=none("gears with t2 above it*")),
    fails("it comes only from the wrong denominator of (9); such gears exist"),
)  # fmt: skip
def width_of_t2() -> Evidence:
    """(10): does t2 >= 1 / s forbid the mechanism?"""
    rng = np.random.default_rng(10)
    s = math.sin(math.pi / 3)
    n = 20_000
    i, y, t1, t2 = (rng.uniform(a, b, n) for a, b in ((1.5, 8.0), (0.3, 2.0), (0.8, 1.2), (1.0 / s, 1.2)))
    both = closed_form.neighbours_direct(i, y, t1, t2, 3)
    fits = closed_form.exists(i, y, t1, t2) & both[0] & both[1]
    return evidence(
        {"1 / sin(pi / 3)": 1.0 / s, "gears with t2 above it that satisfy (6) and (8)": int(fits.sum()), "of": n}
    )


@LEDGER.claim(
    "Y4", "inequalities (11), (12)",
    "lower bound of the ratio from neighbouring planets 3 (denominator damaged; read as in its derivation)", "i > ...",
    holds(when=none("mismatches of the printed bound")),
    only_if("(1 + t1 (1 + y)) s > y t2; otherwise the same expression is an upper bound",
            when=none("mismatches outside Bb < 0", "mismatches with the branch")),
    fails("with the branch too"),
)  # fmt: skip
def lower_bound() -> Evidence:
    """(11) as printed (a lower bound everywhere) and with its branch, against (8)."""
    i, y, t1, t2, k = _cases()
    truth = closed_form.neighbours_direct(i, y, t1, t2, k)[1]
    bound, upper = closed_form.ratio_bound_3(y, t1, t2, k)
    printed = (i > bound) != truth
    branched = closed_form.within_bounds(i, y, t1, t2, k)[1] != truth
    return evidence({
        "mismatches of the printed bound": int(printed.sum()), "cases with Bb < 0": int(upper.sum()),
        "mismatches outside Bb < 0": int((printed & ~upper).sum()), "mismatches with the branch": int(branched.sum()),
        "cases": len(i),
    })  # fmt: skip


@LEDGER.claim(
    "Y5", "after (5)", "0.8 <= t <= 1.2 means pressure angles of 20 to 44 deg in the first stage, or 40 to 20 deg in the second, "
    "as the scan shows it",
    "20 deg ... 44 deg, 40 deg ... 20 deg",
    holds(when=near("arccos(0.8 cos 20 deg) [deg]", 0.5, of=44.0)),
    unreadable("41 for 44, as cos a / cos 20 deg = 0.8 at {angle:.2f} deg; the scan shows one of its digits twice. 40 is {other:.2f} deg, "
               "rounded or damaged too",
               when=near("arccos(0.8 cos 20 deg) [deg]", 0.5, of=41.0)),
    fails("t = 0.8 is {angle:.2f} deg"),
)  # fmt: skip
def range_of_angles() -> Evidence:
    """The pressure angles that belong to t = 0.8 and 1.2."""
    standard = math.cos(closed_form.STANDARD)
    angle, other = math.degrees(math.acos(0.8 * standard)), math.degrees(math.acos(standard / 1.2))
    return evidence({
        "arccos(0.8 cos 20 deg) [deg]": angle,
        "an angle a with cos 20 deg = 0.8 cos a exists": standard / 0.8 <= 1.0,
        "angle a with cos 20 deg = 1.2 cos a [deg]": other,
    }, angle=angle, other=other)  # fmt: skip


@LEDGER.claim(
    "Y6", "conclusion 4", "different pressure angles give more tooth combinations", "more",
    holds(when=above(0, "equal", "additional")),
    fails("no additional combinations"),
)  # fmt: skip
def more_solutions() -> Evidence:
    """Conclusion 4: more tooth combinations than with equal pressure angles."""
    counts = {}
    for ratio, planets in ((6, 3), (6, 4), (4, 3)):
        found = closed_form.series_planets(ratio, planets)
        equal = int(np.count_nonzero(found.z4 == found.z1 + 2 * found.z2))
        counts[f"ratio {ratio}, {planets} planets: all, at 20 deg"] = [len(found), equal]
    rows = list(counts.values())
    return evidence(counts, equal=[e for _, e in rows], additional=[n - e for n, e in rows])


CLAIMS = LEDGER.claims
