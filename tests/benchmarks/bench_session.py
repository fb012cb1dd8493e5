"""Cost of a step loop: `Session.step` against bare `mj_step` on the same model under the same controls, in one run.

    python tests/benchmarks/bench_session.py [NAME ...]

For every mechanism, with an action every 10 ms and with an action every timestep: the median over repeats of the ratio of two
loops that alternate, so that both see the same load of the machine, and the middle half of the ratios. The bare loop writes the
controls and steps; it observes nothing, keeps nothing and tests nothing. The program fails when a ratio is above LIMIT. An action
every timestep is the worst case: the fixed cost of about 2 microseconds stands against a step of 8 to 25. `six_axis_arm`: a robot
with six servos, no loops.
"""

from __future__ import annotations

import statistics
import sys
import time
import warnings

import mujoco
import numpy as np

import mechlab as ml
from mechlab.engines.mujoco.session import Session
from mechlab.engines.mujoco.step_watch import UntrustedSession

LIMIT = 1.3
ACTIONS, REPEATS = 400, 41
LINKS = ((0.089, "z"), (0.136, "y"), (0.425, "y"), (0.392, "y"), (0.109, "z"), (0.095, "y"))
"""Offset from the joint before [m] and axis of each joint of the arm."""


def arm() -> ml.Mechanism:
    """A robot with six revolute joints of the size of a UR5, each with a servo."""
    b, mass = ml.Builder("six_axis_arm", gravity=(0.0, 0.0, -9.81)), 4.0
    for k, (offset, axis) in enumerate(LINKS):
        tensor = (0.01 * mass, 0.01 * mass, 0.005 * mass, 0, 0, 0)
        joint = ml.revolute(f"joint_{k}", axis, armature=0.05)
        inertia = ml.Inertia(mass, com=(0.0, 0.02, 0.1), tensor=tensor)
        parent = f"link_{k - 1}" if k else "ground"
        b.body(f"link_{k}", joint, parent=parent, at=(0.0, 0.0, offset), inertia=inertia)
        b.drive(f"joint_{k}", stiffness=400.0, damping=40.0, limit=150.0)
        mass *= 0.8
    return b.build()


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


def ratios(name: str, hold: float | None) -> tuple[np.ndarray, float]:
    """Quartiles of the ratio of the two loops, and microseconds of a bare action."""
    s = ml.session(arm() if name == "six_axis_arm" else name, hold=hold)
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
    return np.quantile([a / b for a, b in pairs], (0.25, 0.5, 0.75)), 1e6 * statistics.median(b for _, b in pairs) / ACTIONS


def main() -> int:
    """Print the table; 1 when a ratio is above the limit."""
    worst = 0.0
    print(f"{'mechanism':24s} {'action':>10s} {'bare [us]':>10s} {'ratio':>7s}  middle half")
    for name in sys.argv[1:] or ["fourbar", "planetary", "gear_linkage", "delta6", "six_axis_arm"]:
        for hold, text in ((0.01, "10 ms"), (None, "one step")):
            (low, found, high), cost = ratios(name, hold)
            worst = max(worst, found)
            print(f"{name:24s} {text:>10s} {cost:10.1f} {found:7.3f}  {low:.3f} to {high:.3f}", flush=True)
    return int(worst > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
