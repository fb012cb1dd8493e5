"""200 seeded errors in builders, writers and closed forms: which do the checks catch?

    python -m tests.benchmarks.fault_injection [count] [first seed] [mechanism ...]

A closed form that no check calls is not drawn; those are listed, too. 2026-11-21, MuJoCo 4.0.0, Pinocchio 4.1.0: all of the
seeds 0 to 199 and 20000 to 20199 are caught. What that does not say: most faults of builders are caught by the checks of moving
states (`mechlab.kit.mass_check`), whose closed forms say where every particle is and how fast; a mistake that these share
with the builder, such as a wrong value of a parameter, is not drawn.

A process for each mechanism, two at a time. Prints a table by family and kind, and every escape.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from mechlab import catalog

COUNT, PROCESSES = 200, 2
Row = tuple[int, str, str, str, str, str, float]


def work(job: tuple[str, list[int]]) -> list[Row]:
    """The verdicts on the faults of one mechanism: (seed, mechanism, family, kind, text, by, seconds)."""
    from mechlab.lab.design import design
    from mechlab.studies.check.check import checks_of
    from tests.faults.formulas import functions_of
    from tests.faults.hunt import called_formulas, draw, hunt

    name, seeds = job
    d = design(catalog.entry(name), {})
    cost: dict[str, float] = {}

    def once() -> None:
        for check in checks_of(d.entry):
            began = time.process_time()
            assert check.run(d.parameters).passed, f"{name} {check.id} fails without a fault"
            cost[check.id] = time.process_time() - began

    called = called_formulas(name, once)
    idle = {full for full, _ in functions_of(name)} - called
    print(
        f"        {name}: {sum(cost.values()):.1f} s of checks; closed forms that no check calls: {', '.join(sorted(idle)) or 'none'}",
        flush=True,
    )
    out: list[Row] = []
    for seed in seeds:
        for again in range(20):  # a closed form whose calls came out the same is drawn anew
            fault = draw(seed + 100_000 * again, name)
            if fault.wrapper is not None and fault.text.removeprefix("closed form ").partition(":")[0] in idle:
                continue
            verdict = hunt(fault, lambda c: cost[c.id])
            if verdict.by != "no-op":
                break
        out.append((fault.seed, name, fault.family, fault.kind, fault.text, verdict.by, verdict.seconds))
        said = f"{verdict.by or 'ESCAPED':28s} {verdict.seconds:6.1f} s"
        print(f"{fault.seed:7d} {name:22s} {fault.family:17s} {fault.kind:8s} {said}  {fault.text}", flush=True)
    return out


def main(count: int = COUNT, first: int = 0, names: tuple[str, ...] = ()) -> None:
    """Run and print."""
    names = names or catalog.NAMES
    jobs = [(n, list(range(first + k, first + count, len(names)))) for k, n in enumerate(names)]
    with ProcessPoolExecutor(PROCESSES, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        rows = [row for part in pool.map(work, jobs) for row in part]
    seen = Counter((r[2], r[3]) for r in rows)
    caught = Counter((r[2], r[3]) for r in rows if r[5] not in ("", "undecided"))
    print()
    for key in sorted(seen):
        print(f"{key[0]:20s}{key[1]:10s}{caught[key]:4d} of {seen[key]}")
    total = sum(caught.values())
    print(f"\n{total} of {len(rows)} caught ({100 * total / len(rows):.1f} %)")
    for r in rows:
        if r[5] in ("", "undecided"):
            print(f"  {r[5] or 'escaped'}: seed {r[0]}, {r[1]}, {r[2]}, {r[3]}: {r[4]}")


if __name__ == "__main__":
    words = sys.argv[1:]
    numbers = [int(x) for x in words if x.isdigit()]
    names = tuple(x for x in words if not x.isdigit())
    count, first = [*numbers, COUNT, 0][:2] if not numbers else [*numbers, 0][:2]
    main(count, first, names)
