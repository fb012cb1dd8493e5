"""What the timestep of a run costs in accuracy: an error for each channel, from further runs of the whole scene.

    d(k) = max_t |x(h) - x(k h)|,     error of x(h) from d(2) and d(4), by the order that they show (`experiment.order`)

Where that leaves the positions with more than the tolerance of the scene, or 2 h does not come through, 3 h / 2 is asked, then
h / 2: an error that is large only because 2 h is unstable is not one of the run. With kinks in the motion (impacts, dry
friction, limits) two runs may agree by accident, and 4 h / 3 or 2 h / 3 is asked as well. Every run is as long as the scene:
an estimate costs .75 of the run where the step is small enough, 1.2 where 2 h is just too much. The softness of MuJoCo's rows is in
proportion to the step, so that the same runs show what it does to rates, and with them to accelerations and forces. Engines that
control their steps are repeated at LOOSER times their tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.errors import (
    SAFETY,
    SAFETY_SEEN,
    SMALLER,
    differences,
    error_between,
    error_from_coarser,
    error_from_finer,
    error_from_near,
    expected_order,
    largest_difference,
    shared_times,
    step_error_finding,
)
from mechlab.experiment.held_rates import captured
from mechlab.experiment.ranges import stop_advice
from mechlab.experiment.recording import Finding, Health, Recording, state_channels
from mechlab.experiment.scene import Scene, Settings
from mechlab.lab.file_error import with_file_error
from mechlab.lab.order_check import fixed_steps, suspects
from mechlab.lab.problem_settings import other_softness
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.singularity import PASS, nearest_to_singular

Again = Callable[[Scene, Settings, Array], Recording]
"""A scene once more, with other settings, at given times at least."""
FEWEST = 8
"""A run of fewer steps is compared with half the timestep: there are no four of 4 h to compare with."""
ACCIDENT = 8.0
"""With kinks, a change against 2 h of more than this times that against h / 2 may be luck: a third run is made."""
NEAR, NEARER = 1.5, 4.0 / 3.0
"""Factors on the timestep where 2 h is too much."""
UNEVEN = 2.0
"""What soft rows do to rates, and so to accelerations, does not fall evenly with the step: two runs may agree by half of it, as the
campaign `tests.benchmarks.stated_step_error` shows; errors of accelerations and forces are stated so many times larger."""
SMALL, ALONE = 0.1, 1.5
"""Where no third run confirms two, so that nothing shows how fast they converge, they may agree in a channel by accident: one that changes
by less than this share of the largest change in its unit gets an error so many times larger."""
SEEN = SAFETY_SEEN / SAFETY
"""Share of a stated error that is left where two runs of a method of first order show that order."""
JUMP = 4.0
"""A change between samples at more than this times the rates of both its neighbours is a jump."""
LOOKED_AT, FIRST = 250, 16
"""So many samples are examined for singular positions, and, with the first ones, compared with another run where the motion is smooth."""
LOOSER = 10.0
"""Factor on the tolerance. The error is nearly proportional to it: the change is close to ten times the error."""


def with_step_error(recording: Recording, scene: Scene, again: Again | None = None) -> Recording:
    """The recording of a scene with the errors of its channels and the finding "step_error" (see the module), where there are
    any: not for a run that ended early. `again` makes the same scene with other settings; default: the engine alone."""
    if recording.t[-1] < scene.duration * (1.0 - 1e-9) or len(recording.t) < 2:
        return recording
    if recording.settings.engine == "file":
        return with_file_error(recording, scene)
    estimate = _Estimate(recording, scene, again or partial(_run, recording.mechanism))
    if fixed_steps(recording.settings):
        errors, finding = estimate.by_steps()
        errors, passed = estimate.past_singular(estimate.with_softness(errors))
        recording = recording if passed is None else replace(recording, health=recording.health + Health((passed,)))
        if estimate.kinks:
            errors = {n: max(x, jump(recording.t, recording.channels[n])) for n, x in errors.items()}
    else:
        errors, finding = estimate.by_tolerance()
    return replace(recording, errors=errors, health=recording.health + Health((finding,)))


def _run(mechanism: Mechanism, scene: Scene, settings: Settings, times: Array) -> Recording:
    return engine(settings.engine).run(mechanism, scene, settings, times)


@dataclass(frozen=True)
class _Changes:
    """Largest change of every channel and of every coordinate against another run."""

    channels: Mapping[str, float]
    coordinates: Array

    @property
    def largest(self) -> float:
        """Largest change of a coordinate [rad or m]."""
        return float(np.max(self.coordinates, initial=0.0))


class _Estimate:
    """The errors of one run."""

    def __init__(self, recording: Recording, scene: Scene, again: Again) -> None:
        self.recording, self.scene, self.again, self.settings = recording, scene, again, recording.settings
        m = recording.mechanism
        self.soft = self.settings.engine == "mujoco" and m.is_closed
        self.order = expected_order(self.settings, self.soft)
        self.states = state_channels(m)
        self.kinks = any(True for _ in suspects(m, scene, self.settings, recording))
        self.advice = stop_advice(recording.health) or SMALLER

    def by_steps(self) -> tuple[dict[str, float], Finding]:
        """Errors and finding of a run with fixed steps."""
        h, tolerance = self.settings.timestep, self.scene.tolerance
        enough = self.scene.duration >= FEWEST * h * (1.0 - 1e-9)
        twice = self.at(2.0) if enough else None
        shows = self.order == 1 and not self.kinks
        if twice is not None and (shows or error_from_coarser(twice.largest, 0.0, self.order) <= tolerance):
            fourfold = self.at(4.0)
            text = _text((2.0 * h, twice), (4.0 * h, fourfold))
            errors, value = self.combined(twice, fourfold)
            if value <= tolerance:
                return errors, step_error_finding(value, tolerance, text)
            if self.first_order(twice, fourfold):
                errors, value = ({n: SEEN * x for n, x in errors.items()}, SEEN * value)
                return errors, step_error_finding(value, tolerance, text, self.advice)
        near = (
            self.at(NEAR) if enough and self.order > 1 and (twice is None or self.at_best(twice) <= tolerance) else None
        )
        if near is not None:
            nearer = self.at(NEARER) if self.lucky(twice, near) else None
            errors, value = self.bounded(near, nearer, None if self.kinks else twice)
            if twice is None and nearer is None:
                errors = self.unconfirmed(errors)
            if value <= tolerance:
                return errors, step_error_finding(value, tolerance, _text((NEAR * h, near), (NEARER * h, nearer)))
        half = self.at(0.5)
        if half is not None:
            third = self.at(2.0 / 3.0) if self.lucky(twice, half) else None
            errors, value = self.refined(half, third, None if self.kinks else twice)
            return errors, step_error_finding(
                value, tolerance, _text((0.5 * h, half), (2.0 * h / 3.0, third)), self.advice
            )
        if twice is not None:
            errors, value = self.combined(twice, None)
            return errors, step_error_finding(value, tolerance, _text((2.0 * h, twice)), self.advice)
        text = "the run comes through neither at twice the timestep nor at half of it: its error cannot be estimated"
        return {}, Finding("step_error", math.inf, tolerance, "rad or m", "error", text)

    def with_softness(self, errors: dict[str, float]) -> dict[str, float]:
        """The errors with the effect of MuJoCo's soft rows on accelerations and forces; those of positions and rates hold it.
        Softness in proportion to the step was changed with the step, and leaves them UNEVEN times less sure. Of a softness of
        its own another run shows the effect."""
        if not self.soft or not errors:
            return errors
        other = other_softness(self.recording.mechanism, self.settings)
        if other is None:
            return {n: e if n in self.states else UNEVEN * e for n, e in errors.items()}
        found = self.run(other, self.scene, self.recording.t)
        more = {n: math.inf if found is None else found.channels[n] for n in errors if n not in self.states}
        return {n: e + more.get(n, 0.0) for n, e in errors.items()}

    def past_singular(self, errors: dict[str, float]) -> tuple[dict[str, float], Finding | None]:
        """The errors, infinite for accelerations and forces where the run passes a singular position of the
        constraints, and the finding that says so: there they depend on how rows are softened or regularized, and
        smaller steps change them more than larger ones do."""
        r, m = self.recording, self.recording.mechanism
        some = np.unique(np.linspace(0, len(r.t) - 1, min(len(r.t), LOOKED_AT)).round().astype(int))
        k, near = nearest_to_singular(m, r.q[some])
        if near > PASS or not errors:
            return errors, None
        text = (
            f"near t = {r.t[some[k]]:.3g} s the run passes a singular position of the constraints: no error is told of "
            "accelerations and forces"
        )
        known = {n: e if n in self.states else math.inf for n, e in errors.items()}
        return known, Finding("singular_pass", near, PASS, "of the usual distance", "warning", text)

    def by_tolerance(self) -> tuple[dict[str, float], Finding]:
        """Errors and finding of a run that controls its steps."""
        loose, tolerance = LOOSER * self.settings.tolerance, self.scene.tolerance
        # dry friction is smoothed in proportion to the timestep, also by engines that choose their own steps
        other = replace(self.settings, tolerance=loose, timestep=2.0 * self.settings.timestep)
        found = self.run(other, self.scene, self.recording.t)
        if found is None:
            text = f"the run does not come through at a tolerance of {loose:g}: its error cannot be estimated"
            return {}, Finding("step_error", math.inf, tolerance, "rad or m", "error", text)
        text = f"a tolerance of {loose:g} changes the motion by {found.largest:.2g} rad or m"
        severity = "ok" if found.largest <= tolerance else "error"
        text += (
            f" (tolerance {tolerance:g})" if severity == "ok" else f", beyond the tolerance {tolerance:g} of the scene"
        )
        return dict(found.channels), Finding("step_error", found.largest, tolerance, "rad or m", severity, text)

    def at(self, factor: float) -> _Changes | None:
        """The changes against `factor` times the timestep; None when that run fails."""
        r, h = self.recording, self.settings.timestep
        every = h * next(n for n in (1, 2, 3, 4) if abs(n / factor - round(n / factor)) < 1e-9)
        whole = np.flatnonzero(np.abs(r.t / every - np.round(r.t / every)) * every < 1e-6 * h)
        times = np.union1d(r.t[whole if self.kinks else self.telling(whole)], r.t[-1])
        scene = replace(self.scene, laws=captured(self.scene.laws, factor))
        return self.run(replace(self.settings, timestep=factor * h), scene, times)

    def telling(self, samples: NDArray[np.intp]) -> NDArray[np.intp]:
        """About LOOKED_AT of the samples (n,): half of them even in time, half even in the ways of all channels, so that a short event has
        its share; and the first ones, where motions start that die away at once."""
        if len(samples) <= LOOKED_AT:
            return samples
        ways = np.abs(np.diff([x[samples] for x in self.recording.channels.values()]))
        sums = ways.sum(axis=1)
        known = np.isfinite(sums) & (sums > 0.0)
        gone = np.concatenate([[0.0], np.cumsum((ways[known] / sums[known, None]).sum(axis=0))])
        gone = gone / max(gone[-1], 1.0) + np.linspace(0.0, 1.0, len(samples))
        return samples[np.union1d(np.arange(FIRST), np.searchsorted(gone, np.linspace(0.0, gone[-1], LOOKED_AT)))]

    def run(self, settings: Settings, scene: Scene, times: Array) -> _Changes | None:
        """The changes against another run at these times."""
        r = self.recording
        try:
            other = self.again(scene, settings, times)
        except MechlabError:
            return None
        mine, theirs = shared_times(r, other)
        if other.t[-1] < r.t[-1] * (1.0 - 1e-9) or not np.all(np.isfinite(other.q)) or len(mine) < 2:
            return None
        changes = [largest_difference(r.q[mine, k], other.q[theirs, k]) for k in range(r.q.shape[1])]
        return _Changes(differences(r, other, 1.0), np.array(changes))

    def at_best(self, twice: _Changes) -> float:
        """The error [rad or m] that `bounded` states if the change against 2 h shows the order of the method; with kinks the first."""
        p = 1 if self.kinks else self.order
        change = twice.largest * (NEAR**p - 1.0) / (2.0**p - 1.0)
        return error_from_near(change, NEAR, None if self.kinks else twice.largest, p)

    def first_order(self, twice: _Changes, fourfold: _Changes | None) -> bool:
        """Whether two coarser runs of a method of first order show it: changes of h and 3 h."""
        shown = fourfold is not None and abs(fourfold.largest - 3.0 * twice.largest) < 0.5 * twice.largest
        return self.order == 1 and not self.kinks and shown

    def order_of(self, channel: str) -> int:
        """The highest order that the error of a channel may have: rows whose softness is in proportion to the step open by its
        square, at rates in proportion to it, on which accelerations and forces hang."""
        soft = self.soft and self.settings.timeconst is not None
        return 1 if soft and self.recording.units[channel] not in ("m", "rad") else self.order

    def combined(self, twice: _Changes, fourfold: _Changes | None) -> tuple[dict[str, float], float]:
        """Errors of the channels, and the largest of the coordinates, from coarser runs."""
        more = None if fourfold is None else fourfold.channels
        errors = {
            n: error_from_coarser(x, more[n] if more else None, self.order_of(n)) for n, x in twice.channels.items()
        }
        far = [None] * len(twice.coordinates) if fourfold is None else fourfold.coordinates.tolist()
        pairs = zip(twice.coordinates.tolist(), far, strict=True)
        return errors, max((error_from_coarser(a, b, self.order) for a, b in pairs), default=0.0)

    def refined(self, half: _Changes, third: _Changes | None, twice: _Changes | None) -> tuple[dict[str, float], float]:
        """Errors of the channels, and the largest of the coordinates, from finer runs; `twice` where its order counts."""
        if twice is None:
            errors = {n: error_from_finer(x, 0.5) for n, x in half.channels.items()}
            value = error_from_finer(half.largest, 0.5)
        else:
            errors = {n: error_between(x, twice.channels[n], self.order_of(n)) for n, x in half.channels.items()}
            value = error_between(half.largest, twice.largest, self.order)
        if third is not None:
            errors = {n: max(x, error_from_finer(third.channels[n], 2.0 / 3.0)) for n, x in errors.items()}
            value = max(value, error_from_finer(third.largest, 2.0 / 3.0))
        return errors, value

    def bounded(
        self, near: _Changes, nearer: _Changes | None, twice: _Changes | None
    ) -> tuple[dict[str, float], float]:
        """Errors of the channels, and the largest of the coordinates, from runs at less than 2 h; `twice` where its order counts."""
        far = None if twice is None else twice.channels
        errors = {
            n: error_from_near(x, NEAR, far[n] if far else None, self.order_of(n)) for n, x in near.channels.items()
        }
        value = error_from_near(near.largest, NEAR, twice.largest if twice else None, self.order)
        if nearer is not None:
            errors = {n: max(x, error_from_near(nearer.channels[n], NEARER, None, 1)) for n, x in errors.items()}
            value = max(value, error_from_near(nearer.largest, NEARER, None, 1))
        return errors, value

    def unconfirmed(self, errors: dict[str, float]) -> dict[str, float]:
        """Errors of the channels from two runs that no third one confirms: see ALONE."""
        units, largest = self.recording.units, dict[str, float]()
        for n, x in errors.items():
            largest[units[n]] = max(largest.get(units[n], 0.0), x)
        return {n: ALONE * x if x < SMALL * largest[units[n]] else x for n, x in errors.items()}

    def lucky(self, twice: _Changes | None, half: _Changes) -> bool:
        """Whether the agreement with h / 2 may be an accident."""
        return self.kinks and (twice is None or twice.largest > ACCIDENT * half.largest)


def jump(t: Array, values: Array) -> float:
    """The largest jump of a channel between two samples, 0 without: a change of more than JUMP times the rate before and after it.
    Where a motion has kinks the channel is wrong by its jump for as long as the kink is early or late."""
    steps = np.abs(np.diff(values))
    if len(steps) < 3 or not np.all(np.isfinite(steps)):
        return 0.0
    rates = steps / np.diff(t)  # samples may be far apart in one place
    around = np.maximum(np.append(rates[1:], 0.0), np.insert(rates[:-1], 0, 0.0))
    return float(np.max(steps, where=rates > JUMP * around, initial=0.0))


def _text(*runs: tuple[float, _Changes | None]) -> str:
    parts = [f"steps of {h:g} s differ by {x.largest:.2g}" for h, x in runs if x is not None]
    return f"({', '.join(parts)})"
