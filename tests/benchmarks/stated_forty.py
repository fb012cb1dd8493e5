"""Perturbed scenes over all entries and fidelities under --max-error: is a stated error ever below the true one, and how often is
an error refused?

    python -m tests.benchmarks.stated_forty [cases] [first seed] [mechanism ...]

The six benchmark problems come first, as they are; then case k takes entry k of the catalog in turn, a scene, a fidelity, up to three
parameters (0.8 to 1.25 times their default), a target of 1e-3, 1e-4 or 1e-6 and a duration of at most a second. The truth of the
positions are the entry's own equations where it has some, else Pinocchio at 1e-12 (`studies.chart.score.reference_of`), which
error control does not use; the truth of all other channels is Pinocchio by DOP853 at 1e-11, where the motion has no kinks. A line for
each case; then the cases of the smallest margin, every error that was understated, and every refusal (exit 3) with its reason.
Errors below RESOLVED, and what the truth leaves open itself, are not counted.
"""

from __future__ import annotations

import dataclasses
import math
import sys
import time
from dataclasses import dataclass

import numpy as np

import mechlab as ml
from mechlab import catalog
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.acting import is_rough
from mechlab.experiment.entry import Entry
from mechlab.experiment.held_rates import captured
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Settings
from mechlab.lab.fastest_rate import fastest_rate
from mechlab.lab.methods import Problem, has_kinks
from mechlab.lab.single_run import complete
from mechlab.studies.chart.score import Reference, reference_of, tracked

TARGETS, SHARES, LONGEST = (1e-3, 1e-4, 1e-6), (0.25, 0.5, 1.0), 1.0
OUTPUTS = 100
RESOLVED = 1e-9
"""Errors below this share of the size of a channel (at least 1) are those of the truth."""
FOLLOWS, STIFFEST = 1e-6, 5e3
"""The run that tells the truth of channels follows the true positions to this [m or rad]; it is not made for motions longer than
LONGEST, nor for those whose fastest rate times the duration is larger."""
AT_ONCE = 0.02
"""Share of the time in which held rates are captured, in the truth."""
SIX = ("pendulum", "n_fourbar", "andrews", "bricard", "flyball", "slider_crank")
SHARP = Settings("pinocchio", "DOP853", tolerance=1e-11, preset="sharp")


@dataclass(frozen=True)
class Case:
    """One run: what it was, its exit code with the reason, stated and true error of the positions and of the channel with the
    smallest margin (NaN where no truth is known), and the CPU seconds it took."""

    told: str
    exit_code: int
    reason: str
    stated: float
    true: float
    channel: str
    channel_stated: float
    channel_true: float
    seconds: float

    @property
    def margin(self) -> float:
        """Stated over true error of the positions; infinite below what the truth resolves."""
        return self.stated / self.true if self.true > 0.0 else math.inf

    @property
    def channel_margin(self) -> float:
        """The same of the worst channel."""
        return self.channel_stated / self.channel_true if self.channel_true > 0.0 else math.inf


def drawn(rng: np.random.Generator, entry: Entry) -> dict[str, float]:
    """Up to three parameters that are numbers, but no durations."""
    fields = [f for f in dataclasses.fields(entry.parameters) if isinstance(f.default, float) and f.default]
    fields = [f for f in fields if "duration" not in f.name]
    chosen = rng.permutation(len(fields))[: int(rng.integers(0, 4))]
    return {fields[i].name: float(fields[i].default * rng.uniform(0.8, 1.25)) for i in chosen}


def perturbed(name: str, seed: int) -> Case | None:
    """A random case of an entry; None for a draw that its mechanism refuses."""
    entry = catalog.entry(name)
    rng = np.random.default_rng([seed, catalog.NAMES.index(name), 40])
    scene, changes = str(rng.choice(list(entry.scenes))), drawn(rng, entry)
    fidelity = str(rng.choice([f for f in entry.fidelities if f != "kinematic"]))
    target, share = float(rng.choice(TARGETS)), float(rng.choice(SHARES))
    told = f"{name} {scene} {fidelity} {target:.0e} {' '.join(f'{k}={v:.4g}' for k, v in changes.items())}"
    try:
        design = ml.load(name, **changes).for_scene(scene)
        plan = design.scene(scene, fidelity)
        return measured(told, design, dataclasses.replace(plan, duration=share * min(plan.duration, LONGEST)), target)
    except MechlabError as why:
        print(f"refused   {told}: {str(why)[:160]}", flush=True)
        return None


def measured(told: str, design: ml.Design, plan: ml.Scene, target: float) -> Case:
    """The case of a scene under a target."""
    began = time.process_time()
    run = ml.simulate(design, scene=plan.name, fidelity=plan.fidelity, duration=plan.duration, max_error=target)
    spent = time.process_time() - began
    problem = Problem(design, plan, OUTPUTS)
    finding = run.health.finding("max_error")
    true, truth = math.nan, None
    try:
        # a held rate is caught at once in truth; the time in which laws catch it is one of the errors
        truth = reference_of(dataclasses.replace(problem, scene=dataclasses.replace(plan, laws=captured(plan.laws, AT_ONCE))))
    except MechlabError as why:
        told += f" (no truth: {str(why)[:60]})"
    else:
        at = at_times(run, np.linspace(0.0, plan.duration, OUTPUTS + 1))
        found = tracked(problem, truth.names, run.q[at], run.v[at])
        size = max(1.0, float(np.max(np.abs(truth.values))))
        error = float(np.max(np.abs(found - truth.values))) - float(np.nan_to_num(truth.own_error))
        true = error if error > RESOLVED * size else 0.0
    return Case(told, run.exit_code, run.message, finding.value, true, *worst_channel(design, plan, run, truth), spent)


def at_times(run: Recording, times: np.ndarray) -> np.ndarray:
    """Indices of the samples at these times."""
    return np.clip(np.searchsorted(run.t, times * (1.0 - 1e-12)), 0, len(run.t) - 1)


def worst_channel(
    design: ml.Design, plan: ml.Scene, run: Recording, positions: Reference | None
) -> tuple[str, float, float]:
    """The channel with the smallest stated over true error, and both; NaN where the run that should tell does not follow the
    true positions itself, as past singular ones."""
    m = design.mechanism(plan.fidelity)
    slow = fastest_rate(m, plan) * plan.duration > STIFFEST or plan.duration > LONGEST
    if has_kinks(plan) or is_rough(m) or slow or positions is None:
        return "", math.nan, math.nan
    times = run.t[::4]
    try:
        truth = complete(design, engine("pinocchio").run(m, plan, SHARP, times), plan)
    except MechlabError:
        return "", math.nan, math.nan
    mine, theirs = at_times(run, times), at_times(truth, times)
    problem = Problem(design, plan, OUTPUTS)
    follows = at_times(truth, np.linspace(0.0, plan.duration, OUTPUTS + 1))
    there = tracked(problem, positions.names, truth.q[follows], truth.v[follows])
    off = float(np.max(np.abs(there - positions.values))) if len(there) == len(positions.values) else math.inf
    if off > FOLLOWS:
        return "", math.nan, math.nan
    worst = ("", math.inf, 0.0)
    for name, stated in run.errors.items():
        if name not in truth.channels or not math.isfinite(stated):
            continue
        values = truth.channels[name][theirs]
        true = float(np.max(np.abs(run.channels[name][mine] - values)))
        # accelerations and forces of stabilized rows are known less well
        state = run.units.get(name) in ("m", "rad", "m/s", "rad/s")
        true -= max(3.0 * off, 1e-8 if state else 1e-6) * max(1.0, float(np.max(np.abs(values))))
        if true > 0.0 and stated / true < worst[1] / max(worst[2], 1e-300):
            worst = (name, stated, true)
    return worst if worst[0] else ("", math.nan, math.nan)


def line(case: Case) -> str:
    """One case as a row of the table."""
    return (
        f"{case.told:78.78s} exit {case.exit_code}  {case.stated:9.2g} {case.true:9.2g} {case.margin:8.3g}   "
        f"{case.channel:22.22s}{case.channel_stated:9.2g} {case.channel_true:9.2g} {case.channel_margin:8.3g}  {case.seconds:6.2f} s"
    )


def main(count: int = 40, first: int = 0, names: tuple[str, ...] = ()) -> None:
    """Run and print."""
    print(f"{'case':78s} exit {'stated':>11s} {'true':>9s} {'ratio':>8s}   {'worst channel':22s}{'stated':>9s} {'true':>9s} {'ratio':>8s}")
    cases: list[Case] = []
    for name in () if names else SIX:
        design = ml.load(name).for_scene(None)
        plan = design.scene()
        cases.append(measured(f"{name} as it is 1e-03", design, plan, 1e-3))
        print(line(cases[-1]), flush=True)
    chosen = names or catalog.NAMES
    seed, drawn_cases = first, 0
    while drawn_cases < count:
        case = perturbed(chosen[seed % len(chosen)], seed)
        seed += 1
        if case is not None:
            drawn_cases += 1
            cases.append(case)
            print(line(case), flush=True)
    low = [c for c in cases if c.margin < 1.0 or c.channel_margin < 1.0]
    refusals = [c for c in cases if c.exit_code]
    known = [c for c in cases if not math.isnan(c.true)]
    print(f"\n{len(cases)} cases, {len(known)} with a truth; understated: {len(low)}; exit 3: {len(refusals)}")
    for title, some in (("smallest margins", sorted(known, key=lambda c: c.margin)[:8]), ("understated", low)):
        print(f"\n{title}")
        for c in some:
            print(line(c))
    print("\nrefused, and why")
    for c in refusals:
        print(f"{c.told}: {c.reason[:700]}")


if __name__ == "__main__":
    numbers = [int(x) for x in sys.argv[1:] if x.isdigit()] + [40, 0]
    start = numbers[1] if len(numbers) > 3 else 0
    main(numbers[0], start, tuple(x for x in sys.argv[1:] if not x.isdigit()))
