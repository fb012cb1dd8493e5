"""Under-given questions on random mechanisms: no quantity that is open may be answered, none that is fixed called open.

    python -m tests.benchmarks.under_given [COUNT] [SEED]

The adversary is Pinocchio's kinematics: it looks for other states that have all the given values (poses by Newton from
starts nearby, rates and accelerations along the null space of its Jacobians). An answer that differs between them was
invented; a quantity that never differs is no open one.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import null_space

from mechlab.engines.pinocchio.constraints import PinConstraints
from mechlab.engines.pinocchio.inverse import assemble
from mechlab.engines.pinocchio.kinematics import PinKinematics, frame_motion
from mechlab.engines.pinocchio.quantities import Quantities
from mechlab.errors import MechlabError
from mechlab.kit.quantities import level
from mechlab.lab.ask import ask
from mechlab.lab.design import design
from mechlab.lab.own_mechanism import entry_of
from mechlab.mechanism import Mechanism, integrate
from mechlab.mechanism.structure import sample_poses, structure
from tests.engines.pinocchio.random_mechanisms import random_mechanism

NEAR = 0.05
"""Other poses are sought from so far away [rad or m]."""
SAME = 1e-7
"""States that have the same given values agree to this in what these determine: Newton's 1e-11 times the condition."""
DIFFERENT = 1e-5
"""An open quantity changes by more than this when the state is moved by NEAR."""


@dataclass
class Verdict:
    """What became of one question."""

    seed: int
    text: str
    invented: dict[str, float] = field(default_factory=dict)
    falsely_open: list[str] = field(default_factory=list)
    answered: int = 0
    open: int = 0
    refused: bool = False


def mechanism(seed: int) -> Mechanism:
    """A random mechanism with two to eight freedoms: a tree with up to two loops of random kinds, gears, shafts."""
    rng = np.random.default_rng(seed)
    for k in range(100):
        m = random_mechanism(10_000 * seed + k, bodies=int(rng.integers(3, 8)), loops=bool(rng.integers(2)))
        if 2 <= structure(m).mobility <= 8:
            return m
    raise AssertionError(f"seed {seed}: no mechanism with some freedoms was drawn")


def state(m: Mechanism, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A pose near the reference, rates and accelerations that meet the constraints."""
    q = sample_poses(m, 1, seed=int(rng.integers(1000)))[-1]
    kin = PinKinematics(m, q)
    free = null_space(PinConstraints(kin).jacobian()) if m.loops or m.relations else np.eye(m.nv)
    v = free @ rng.normal(size=free.shape[1])
    constraints = PinConstraints(PinKinematics(m, q, v))
    a = -np.linalg.pinv(constraints.jacobian()) @ constraints.bias() + free @ rng.normal(size=free.shape[1])
    return q, v, a


def value(m: Mechanism, key: str, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> float:
    """A quantity at a state, by Pinocchio."""
    name, order = level(m, key)
    if name in m.scalar_names:
        return float(m.value(name, q) if order == 0 else m.row(name) @ (v, a)[order - 1])
    frame, _, letter = name.rpartition("_")
    pose, velocity, acceleration = frame_motion(m, frame, q, v, a)
    k = ("x", "y", "z", "wx", "wy", "wz").index(letter)
    return float((pose[k, 3] if k < 3 else np.nan) if order == 0 else (velocity, acceleration)[order - 1][k])


def question(m: Mechanism, rng: np.random.Generator) -> dict[str, float]:
    """Some given quantities, fewer than there are freedoms at one level at least, with values of one state."""
    q, v, a = state(m, rng)
    names = [*m.scalar_names, *(f"{f.name}_{x}" for f in m.frames for x in "xyz")]
    count = structure(m).mobility
    some = [str(n) for n in rng.permutation(names)]
    given: dict[str, float] = {n: value(m, n, q, v, a) for n in some[: int(rng.integers(0, count))]}
    if not given or rng.random() < 0.6:
        again = [str(n) for n in rng.permutation(names)] if rng.random() < 0.5 else some
        given |= {f"{n}_rate": value(m, f"{n}_rate", q, v, a) for n in again[: int(rng.integers(1, count + 1))]}
        given |= {f"{n}_accel": value(m, f"{n}_accel", q, v, a) for n in again[: int(rng.integers(0, count))]}
    return given


def others(m: Mechanism, given: dict[str, float], assumed: dict[str, float], rng: np.random.Generator, count: int):
    """States that have all the given (and assumed) values: the one found first, then others near it."""
    levels: tuple[dict[str, float], ...] = ({}, {}, {})
    for key, x in (given | assumed).items():
        name, order = level(m, key)
        levels[order][name] = x
    first = assemble(m, levels[0], steps=10, keep_mode=False, watch=False)
    for k in range(count + 1):
        q = first.q
        if k:
            start = integrate(m, first.q, NEAR * rng.normal(size=m.nv))
            found = assemble(m, levels[0], start=start, keep_mode=False, watch=False)
            if not found.closed or not _connected(m, levels[0], first.q, found.q):
                continue
            q = found.q
        yield q, *_motion(m, q, levels[1], levels[2], rng if k else None)


def _connected(m, position, one, two, depth=4):
    """Whether poses that have the given values lead from one to the other: else it is another assembly mode. Each half of
    the way has a pose near its middle, four times over."""
    far = np.linalg.norm(two - one)
    if depth == 0 or far < 1e-9:
        return True
    start = 0.5 * (one + two)
    for joint in (j for j in m.joints if j.kind == "spherical"):
        start[m.q_slice[joint.name]] /= np.linalg.norm(start[m.q_slice[joint.name]])
    middle = assemble(m, position, start=start, keep_mode=False, watch=False)
    ways = [np.linalg.norm(middle.q - x) for x in (one, two)]
    if not middle.closed or max(ways) > 0.75 * far:
        return False
    return all(_connected(m, position, x, middle.q, depth - 1) for x in (one, two))


def _motion(m, q, rates, accelerations, rng):
    kin = PinKinematics(m, q)
    matrix = np.vstack([PinConstraints(kin).jacobian(), Quantities(kin, list(rates)).jacobian().reshape(-1, m.nv)])
    v = _any(matrix, np.r_[np.zeros(len(matrix) - len(rates)), list(rates.values())], rng)
    kin = PinKinematics(m, q, v)
    constraints, items = PinConstraints(kin), Quantities(kin, list(accelerations))
    matrix = np.vstack([constraints.jacobian(), items.jacobian().reshape(-1, m.nv)])
    bias = np.r_[constraints.bias(), items.bias()]
    a = _any(matrix, np.r_[np.zeros(len(constraints.bias())), list(accelerations.values())] - bias, rng)
    return v, a


def _any(matrix, right, rng):
    """A solution of the system; a random one with rng."""
    x = np.linalg.lstsq(matrix, right, rcond=1e-11)[0] if len(matrix) else np.zeros(matrix.shape[1])
    free = null_space(matrix, rcond=1e-9) if len(matrix) else np.eye(matrix.shape[1])
    return x + free @ rng.normal(size=free.shape[1]) if rng is not None else x


def examine(seed: int) -> Verdict | None:
    """One question; None where its values could not be reached from the reference pose."""
    rng = np.random.default_rng(seed)
    m = mechanism(seed)
    given = question(m, rng)
    out = Verdict(seed, f"{m.name}: {' '.join(given)}")
    keys = [k for k in _wanted(m, given) if k not in given]
    try:
        answers = ask(design(entry_of(m), {}), given)
    except MechlabError as error:
        if "determines nothing else" not in str(error):
            raise
        answers, out.refused = None, True
    if answers is not None and answers.exit_code:
        return None
    values = {} if answers is None else dict(answers["pinocchio"])
    assumed = {} if answers is None else answers.assumed
    opened = keys if answers is None else [k for x in answers.open for k in x.quantities]
    out.answered, out.open = len(values), len(opened)
    seen = {k: [] for k in keys}
    for q, v, a in others(m, given, assumed, rng, 6):
        for key in keys:
            seen[key].append(value(m, key, q, v, a))
    for key, found in seen.items():
        spread = (max(found) - min(found)) / max(1.0, *map(abs, found)) if found else 0.0
        if key in values and spread > SAME:
            out.invented[key] = spread
        if key in opened and spread < SAME and answers is not None and len(found) > 3:
            out.falsely_open.append(key)
    return out


def _wanted(m, given):
    from mechlab.lab.ask import _wanted as wanted

    return wanted(m, given)


def main(count: int = 200, first: int = 0) -> int:
    """Run the campaign and print its counts and its worst cases; the exit code says whether anything was invented."""
    done, unreachable, seed = [], 0, first
    while len(done) < count:
        found = examine(seed)
        seed += 1
        if found is None:
            unreachable += 1
        else:
            done.append(found)
    invented, false = [x for x in done if x.invented], [x for x in done if x.falsely_open]
    print(f"{len(done)} questions ({unreachable} drawn out of reach): {sum(x.refused for x in done)} refused as fixing nothing, "
          f"{sum(x.answered for x in done)} quantities answered, {sum(x.open for x in done)} open")  # fmt: skip
    print(f"invented: {sum(len(x.invented) for x in done)} in {len(invented)} questions")
    print(f"called open though they never change: {sum(len(x.falsely_open) for x in false)} in {len(false)} questions")
    for x in sorted(invented, key=lambda x: -max(x.invented.values()))[:10]:
        print(f"  seed {x.seed} {x.text}: invented {x.invented}")
    for x in false[:10]:
        print(f"  seed {x.seed} {x.text}: not open {x.falsely_open}")
    return 1 if invented else 0


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
