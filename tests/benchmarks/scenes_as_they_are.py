"""All scenes of the catalog at all fidelities, with the settings that they recommend: which are refused, and the dearest.

    python -m tests.benchmarks.scenes_as_they_are [NAME ...]

A newcomer's first `simulate NAME` should be answered. The scenes in MEANT show what a refusal looks like.
"""

from __future__ import annotations

import sys
import time

import mechlab as ml
from mechlab import catalog
from mechlab.errors import MechlabError

MEANT = {("class4_linkage", "into-the-fold", "minimal"), ("gear_linkage", "near-change-point", "minimal")}
"""Scenes that drive a linkage where it cannot go."""
DEAREST = 15


def cases() -> list[tuple[str, str, str]]:
    """Entry, scene, fidelity."""
    entries = [(n, catalog.entry(n)) for n in catalog.NAMES]
    return [(n, s, f) for n, e in entries for s in e.scenes for f in e.fidelities if f != "kinematic"]


def verdict(name: str, scene: str, fidelity: str) -> tuple[float, str]:
    """CPU seconds, and why it is refused ("" when it is not)."""
    began = time.process_time()
    try:
        findings = ml.simulate(name, scene=scene, fidelity=fidelity).health.findings
    except MechlabError as error:
        return time.process_time() - began, str(error)
    return time.process_time() - began, "; ".join(x.sentence for x in findings if x.severity == "error")


def main() -> None:
    """Print both lists."""
    wanted = sys.argv[1:]
    found = {case: verdict(*case) for case in cases() if not wanted or case[0] in wanted}
    refused = {case: why for case, (_, why) in found.items() if why}
    for case, why in refused.items():
        print(f"{'meant  ' if case in MEANT else 'REFUSED'} {' '.join(case)}: {why[:160]}")
    for case, (seconds, _) in sorted(found.items(), key=lambda x: -x[1][0])[:DEAREST]:
        print(f"{seconds:6.2f} s  {' '.join(case)}")
    print(f"{len(found)} scenes, {len(refused)} refused, {sum(s for s, _ in found.values()):.0f} s of CPU")
    sys.exit(0 if set(refused) <= MEANT else 3)


if __name__ == "__main__":
    main()
