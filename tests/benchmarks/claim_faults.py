"""Wrong formulas behind the ledger of claims: how often does a verdict change?

    python -m tests.benchmarks.claim_faults [count] [seed] [entry ...]

Every formula of `mechlab.analytic` that runs while a claim is tested is rewritten in one place (an operation, a sign, a constant, a
trigonometric function), for `count` mutants drawn evenly over the formulas of each entry. The claims that use it are tested again,
the cheapest first, until a verdict is another or the claim cannot be computed any more. Prints a line a mutant, and at the end
how many flipped a verdict, changed its words or numbers alone, or changed nothing (most of these are mutants in a branch that the
claims do not enter, or that mean the same).

2026-11-23, eight mutants each of planetary, gear_linkage, prosthetic_leg, class4_linkage (seed 0), delta6 and closed_differential (seed 1):
28 flip a verdict, 3 its words and 2 its numbers alone (four of these five belong to claims that fail either way), 15 change nothing.
30 mutants of impulse_transmission (seed 3): 19 flip a verdict, 6 its words, 1 its numbers alone, 4 change nothing.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from mechlab import catalog

COUNT, PROCESSES = 20, 2
Row = tuple[str, str, str, str]
"""Entry, formula, what became of it, by which claim."""


def work(job: tuple[str, int, int]) -> list[Row]:
    """The mutants of the formulas of one entry."""
    from tests.faults.patch import replaced
    from tests.faults.wrong_formulas import finding_of, formulas_behind, function_of, mutants, rewritten

    name, count, seed = job
    claims = {c.id: c for c in catalog.entry(name).claims}
    cost, before = {}, {}
    users: dict[str, list[str]] = {}
    for k, claim in claims.items():
        for formula in formulas_behind(claim):
            users.setdefault(formula, []).append(k)
        began = time.process_time()
        before[k] = finding_of(claim)
        cost[k] = time.process_time() - began
    rng = np.random.default_rng(seed)
    pool = {f: list(rng.permutation(np.array(mutants(function_of(f)), dtype=object))) for f in sorted(users)}
    rows: list[Row] = []
    while len(rows) < count and any(pool.values()):
        formula = str(rng.choice(sorted(f for f, left in pool.items() if left)))
        target = function_of(formula)
        wrong = rewritten(target, pool[formula].pop())
        fate, by = "no effect", ""
        with replaced(target, lambda _, w=wrong: w) as places:
            assert places, f"nothing holds {formula}"
            for k in sorted(users[formula], key=cost.__getitem__):
                verdict, sentence, said = finding_of(claims[k])
                if verdict != before[k][0]:
                    fate, by = "flipped", f"{k}: {before[k][0]} -> {verdict}"
                    break
                if sentence != before[k][1]:
                    fate, by = "other words", k
                elif said != before[k][2] and fate == "no effect":
                    fate, by = "other numbers", k
        rows.append((name, formula, fate, by))
        print(f"{name:22s} {formula:48s} {fate:14s} {by}", flush=True)
    return rows


def main(count: int = COUNT, seed: int = 0, names: tuple[str, ...] = ()) -> None:
    """Run and print."""
    names = names or tuple(n for n in catalog.NAMES if catalog.entry(n).claims)
    with ProcessPoolExecutor(PROCESSES, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        rows = [row for part in pool.map(work, [(n, count, seed) for n in names]) for row in part]
    print()
    for name in names:
        seen = Counter(r[2] for r in rows if r[0] == name)
        print(f"{name:22s} " + ", ".join(f"{n} {fate}" for fate, n in seen.most_common()))
    seen = Counter(r[2] for r in rows)
    used = len(rows) - seen["no effect"]
    print(f"\n{len(rows)} mutants: {', '.join(f'{n} {fate}' for fate, n in seen.most_common())}")
    print(f"{seen['flipped']} of the {used} that change anything change a verdict ({100.0 * seen['flipped'] / max(1, used):.0f} %)")


if __name__ == "__main__":
    words = sys.argv[1:]
    numbers = [int(x) for x in words if x.isdigit()]
    main(*([*numbers, COUNT, 0][:2] if not numbers else [*numbers, 0][:2]), tuple(x for x in words if not x.isdigit()))
