"""Cost of a step loop: `Session.step` against bare `mj_step` on the same model under the same controls, in one run.

    python tests/benchmarks/bench_session.py [NAME ...]

For every mechanism, with an action every 10 ms and with an action every timestep: the median over repeats of the ratio of two
loops that alternate, so that both see the same load of the machine. The bare loop writes the controls and steps; it observes
nothing, keeps nothing and tests nothing. The program fails when the ratio for an action every 10 ms, the default, is above LIMIT. An action
every timestep is the worst case: the fixed cost of 2 to 4 microseconds stands against a step of 7 to 25.
"""

from __future__ import annotations

import statistics
import sys
import time
import warnings

import mujoco
import numpy as np

import mechlab as ml
from mechlab.engines.mujoco.session import Session, UntrustedSession

LIMIT = 1.3
ACTIONS, REPEATS = 400, 25


def bare(s: Session, controls: np.ndarray) -> float:
    """CPU seconds of a loop that steps the session's model without the session."""
    model, data = s.model, s.data
    substeps, step, ctrl = s.substeps, mujoco.mj_step, s.data.ctrl
    began = time.thread_time()
    for u in controls:
        ctrl[:] = u
        for _ in range(substeps):
            step(model, data)
    return time.thread_time() - began


def policy(s: Session, actions: np.ndarray) -> float:
    """CPU seconds of the same loop through the session; looks at the health fall into it."""
    step = s.step
    began = time.thread_time()
    for action in actions:
        step(action)
    return time.thread_time() - began


def ratio(name: str, hold: float | None) -> tuple[float, float]:
    """Median ratio of the two loops, and microseconds of a bare action."""
    s = ml.session(name, hold=hold)
    low, high, rest = s.action_low, s.action_high, s.rest_action
    gentle = 1e-3 * np.minimum(high - low, 1.0)
    actions = rest + gentle * np.sin(np.linspace(0.0, 20.0, ACTIONS))[:, None]
    pairs = []
    for _ in range(REPEATS):
        s.reset()
        own = policy(s, actions)
        s.reset()
        pairs.append((own, bare(s, actions - rest)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UntrustedSession)
        s.close()
    return statistics.median(a / b for a, b in pairs), 1e6 * statistics.median(b for _, b in pairs) / ACTIONS


def main() -> int:
    """Print the table; 1 when a ratio is above the limit."""
    worst = 0.0
    print(f"{'mechanism':24s} {'action':>10s} {'bare [us]':>10s} {'ratio':>7s}")
    for name in sys.argv[1:] or ["fourbar", "planetary", "gear_linkage", "delta6"]:
        for hold, text in ((0.01, "10 ms"), (None, "one step")):
            found, cost = ratio(name, hold)
            worst = max(worst, found if hold else 0.0)
            print(f"{name:24s} {text:>10s} {cost:10.1f} {found:7.3f}", flush=True)
    return int(worst > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
