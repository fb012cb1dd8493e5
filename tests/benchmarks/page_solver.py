"""Random slider positions and drags in the page's solver, each checked against Pinocchio, small steps and numpy.

    python tests/benchmarks/page_solver.py [events a mechanism, default 200] [seed] [names...]

Prints for each mechanism of `tests.viewer.solver_witness.MECHANISMS` the median and longest time of a solve in Node, what
stopped how often, and every check that failed; exit code 1 where one did.
"""

from __future__ import annotations

import sys
from collections import Counter

import numpy as np

from mechlab.mechanism.geometry import Array
from tests.viewer.solver_in_node import Conversation
from tests.viewer.solver_witness import MECHANISMS, Witness, mechanism_of

HOME = 10
"""Events after which the mechanism goes back to its reference pose."""


def campaign(name: str, fidelity: str | None, events: int, seed: int) -> int:
    """Runs one mechanism; returns the number of events with a failed check."""
    m = mechanism_of(name, fidelity)
    rng, times, said, failed = np.random.default_rng(seed), [], Counter[str](), []
    with Conversation(m) as page:
        witness = Witness(m, tuple(page.ask("facts")["drives"]))
        q: Array = m.reference()
        for k in range(events):
            if k % HOME == 0:
                q = np.array(page.ask("set", q=m.reference().tolist()))
            wish = witness.wish(rng, q)
            report = page.ask("solve", **wish)
            times.append(report["milliseconds"])
            said.update({s["why"] for s in report["stops"]})
            said["other mode"] += report["modeChanged"]
            try:
                witness.check(q, wish, report)
            except AssertionError as error:
                failed.append(f"event {k}: {str(error).splitlines()[0]}")
            q = np.array(report["q"])
    words = ", ".join(f"{why} {count}" for why, count in said.items() if count)
    print(f"{name:16} {np.median(times):8.3f} ms, longest {max(times):7.1f} ms; {words or 'never stopped'}; {len(failed)} failed")
    for line in failed:
        print(f"    {line}")
    return len(failed)


if __name__ == "__main__":
    count, seed = (int(x) for x in (sys.argv[1:3] + ["200", "1"][len(sys.argv[1:3]) :]))
    cases = [case for case in MECHANISMS if not sys.argv[3:] or case[0] in sys.argv[3:]]
    sys.exit(1 if sum(campaign(*case, count, seed) for case in cases) else 0)
