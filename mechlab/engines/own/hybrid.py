"""Engine `hybrid`: the equations of motion of another engine (EQUATIONS_OF) with set-valued dry friction, not smoothed, and with held
rates (`mechlab.experiment.held_rates`) that are held exactly instead of captured in a short time.

DOP853 between located events (a rate that reaches its target sticks, a force that reaches its bound breaks away), in parts that
start on the constraints. The finding "friction" counts the events and the time for which each rate was held.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mechlab.clock import costed, spent_on
from mechlab.engines.protocol import Engine, available, engine
from mechlab.engines.state import BlowUp, Instant
from mechlab.errors import MechlabError
from mechlab.experiment.acting import is_rough
from mechlab.experiment.energy import energy_finding
from mechlab.experiment.findings import kinematic_findings, saturation_finding, stopped_finding
from mechlab.experiment.held_rates import without_holds
from mechlab.experiment.laws import Law
from mechlab.experiment.prices import EQUATIONS, Price
from mechlab.experiment.recording import Cost, Finding, Health, Recording, over_samples
from mechlab.experiment.scene import Scene, Settings, initial_state, sample_grid
from mechlab.integrate import Ending, HybridTrajectory, Modes, integrate_hybrid
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.statics import DryFriction

EQUATIONS_OF = "pinocchio"
"""The engine whose equations of motion are integrated."""
HELD, UNHOLDABLE = 1e-7, 1e100
"""A stuck rate that still changes by more than this share of the largest acceleration is not held, and the force [N m or N] that stands for
this: larger than any bound."""


class RoughEquations:
    """Equations of a mechanism with set-valued dry friction and held rates: a `mechlab.integrate.RoughProblem` over an engine's equations.

    A sliding element carries the bound against its mode; a stuck one (mode 0) is one more constraint row, rate = target, whose reaction
    is its force. Work and everything else as in the engine's equations. `rows` (k, nv), `limits` (k, 2) [N m or N], `targets` (k,) [rad/s
    or m/s] and `names` of the k elements, dry friction of the mechanism first; `rates` (k, state) picks their rates from a state.
    """

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> None:
        laws, self.holds = without_holds(laws)
        self.equations = engine(EQUATIONS_OF).equations(mechanism, laws, 0.0)
        self.plant = self.equations.plant
        friction = DryFriction.of(mechanism)
        held = [np.sum([c * mechanism.row(n) for n, c in h.terms], axis=0) for h in self.holds]
        self.names = (*friction.names, *(" and ".join(n for n, _ in h.terms) for h in self.holds))
        self.rows = np.vstack([friction.rows, np.reshape(held, (-1, mechanism.nv))])
        low, high = [*-friction.sizes, *(h.low for h in self.holds)], [*friction.sizes, *(h.high for h in self.holds)]
        self.limits = np.stack([low, high], axis=1)
        self.targets = np.array([*(0.0 for _ in friction.names), *(h.rate for h in self.holds)])
        size = mechanism.nq + mechanism.nv + len(self.equations.memory) + 1
        self.rates = np.zeros((len(self.limits), size))
        self.rates[:, mechanism.nq : mechanism.nq + mechanism.nv] = self.rows
        self.modes: Modes = tuple(0 for _ in self.limits)
        self._friction = np.zeros(len(self.limits))
        self.trouble = ""
        self.closed = len(self.plant.constraints) > 0 or bool(self.equations.quaternions)
        """Whether states must be projected: onto loops and relations, or to quaternions of unit length."""

    def instant(self, t: float, y: Array) -> Instant:
        """Accelerations, reactions and forces at a state in the present modes; the holding forces count to those of the laws."""
        found: Instant = self.equations.instant(t, y, self._forward)
        if not self.holds:
            return found
        forces = dict(found.forces)
        for hold, f in zip(self.holds, self._friction[len(self.names) - len(self.holds) :].tolist(), strict=True):
            for name, c in hold.terms:
                forces[name] = forces.get(name, 0.0) + c * f
        return replace(found, forces=forces)

    def _forward(self, force: Array) -> tuple[Array, Array, Array]:
        """Force with friction, accelerations, reactions of the constraint rows; see `Equations.forward` of the engine."""
        modes = np.array(self.modes)
        self._friction = friction = np.where(modes == 0, 0.0, np.where(modes > 0, *self.limits.T))
        stuck = modes == 0
        sliding = force + self.rows.T @ friction
        if not stuck.any():
            return sliding, *self.plant.accelerations(sliding)
        a, r = self.plant.accelerations(sliding, self.rows[stuck])
        count = len(self.plant.constraints)
        friction[stuck] = r[count:]
        return force + self.rows.T @ friction, a, r[:count]

    def slope(self, t: float, y: Array, modes: Modes | None = None) -> Array:
        """dy/dt in these modes; not a number where the equations have no answer, `trouble` says why."""
        if modes is not None:
            self.modes = modes
        try:
            return np.asarray(self.equations.slope(t, y, self._forward))
        except BlowUp as trouble:
            self.trouble = trouble.reason
            return np.full(len(y), np.nan)

    def holding(self, t: float, y: Array, modes: Modes) -> Array:
        """(k,) friction forces in these modes; UNHOLDABLE, against its acceleration, of a stuck element that no force can hold: a slide
        passes a dead centre, where a force on it cannot stop the crank."""
        self.modes = modes
        a = self.instant(t, y).a
        pull = self.rows @ a
        lost = (np.array(modes) == 0) & (np.abs(pull) > HELD * (1.0 + float(np.max(np.abs(a), initial=0.0))))
        return np.where(lost, -np.copysign(UNHOLDABLE, pull), self._friction)

    def project(self, t: float, y: Array) -> Array:
        """The nearest state on the constraints, in the sense of the kinetic energy."""
        return np.asarray(self.equations.project(t, y))

    def settle(self, t: float, y: Array, modes: Modes) -> Array:
        """The state with the rates of stuck elements at their targets: the smallest change of rates, measured by the kinetic energy."""
        y, stuck = self.project(t, y), np.array(modes) == 0
        plant = self.equations.move(t, y)
        self.equations.split(y)[1][:] += plant.stopping(self.rows[stuck], self.targets[stuck])
        return y


def recording_of(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings,
    motion: RoughEquations,
    parts: list[HybridTrajectory],
    end: BlowUp | None,
    spent: float,
) -> Recording:
    """The samples of all parts in one Recording; `end` is what stopped the run early. Raises MechlabError when there is
    no part at all."""
    if not parts:
        assert end is not None
        raise MechlabError(f"{mechanism.name}: the hybrid run cannot start: {end.reason}.")
    t = np.concatenate([parts[0].t[:1], *(p.t[1:] for p in parts)])
    y = np.vstack([parts[0].y[:1], *(p.y[1:] for p in parts)])
    modes = np.vstack([parts[0].modes[:1], *(p.modes[1:] for p in parts)])
    instants = []
    for now, state, mode in zip(t, y, modes, strict=True):
        motion.modes = tuple(int(m) for m in mode)
        instants.append(motion.instant(now, motion.project(now, state)))
    q, v = y[:, : mechanism.nq], y[:, mechanism.nq : mechanism.nq + mechanism.nv]
    found, units = motion.equations.channels(t, q, v, instants)
    with spent_on("check"):
        findings = list(kinematic_findings(mechanism, q, v))
        power = np.array([x.power for x in instants])
        findings.append(energy_finding(mechanism, t, q, v, power, y[:, -1], laws=scene.laws))
    limited = saturation_finding(scene.laws, over_samples([x.forces for x in instants]))
    if limited is not None:
        findings.append(limited)
    findings.append(_friction(motion, parts))
    if end is not None:
        findings.insert(0, stopped_finding(end.t, scene.duration, end.reason))
    evaluations = sum(p.evaluations for p in parts)
    return Recording(
        mechanism=mechanism, t=t, q=q, v=v, channels=found, units=units, health=Health(tuple(findings)),
        cost=Cost(spent, sum(p.steps for p in parts), evaluations), settings=replace(settings, integrator="DOP853"),
        scene=scene.name, name=mechanism.name, fidelity=scene.fidelity, versions=engine(EQUATIONS_OF).versions(),
    )  # fmt: skip


def _friction(motion: RoughEquations, parts: list[HybridTrajectory]) -> Finding:
    """The finding "friction": number of events, and the time [s] for which each joint or shaft stood still or kept its rate."""
    names = motion.names
    if not names:
        return Finding("friction", 0.0, 0.0, "events", "ok", "no dry friction: plain DOP853")
    stuck = np.sum([p.stuck_time for p in parts], axis=0)
    events = sum(len(p.events) for p in parts)
    kept = [False] * (len(names) - len(motion.holds)) + [bool(h.rate) or len(h.terms) > 1 for h in motion.holds]
    how = ("kept the held rate" if rate else "stood still" for rate in kept)
    spans = ", ".join(f"{n} {words} for {float(s):.6g} s" for n, words, s in zip(names, how, stuck, strict=True))
    text = f"dry friction and held rates were followed through {events} events without smoothing; {spans}"
    return Finding("friction", float(events), 0.0, "events", "ok", text)


RESTART = 20
"""A mechanism with loops or gears is projected onto them after so many samples."""


@costed
def run(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings | None = None,
    times: ArrayLike | None = None,
    *,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """A run of the scene with exact dry friction: DOP853 between located events, relative `settings.tolerance`.

    Finding "friction" counts the events and the time each joint or shaft stood still; a run that cannot go on ends
    there with the finding "blow_up" (error). Raises MechlabError for bad input, NoSolution when the start does not close.
    """
    chosen = settings or Settings(engine="hybrid", integrator="DOP853")
    samples = sample_grid(scene.duration, min(chosen.timestep, scene.duration / 200.0), times)
    q, v = initial_state(mechanism, scene)
    motion = RoughEquations(mechanism, scene.laws)
    began = time.thread_time()
    with spent_on("integrate"):
        parts, end = _integrate(motion, samples, motion.equations.start(q, v), chosen.tolerance, progress)
    spent = time.thread_time() - began
    with spent_on("record"):
        return recording_of(mechanism, scene, chosen, motion, parts, end, spent)


def _integrate(
    motion: RoughEquations, times: Array, y: Array, tolerance: float, progress: Callable[[float], None] | None
) -> tuple[list[HybridTrajectory], BlowUp | None]:
    """All parts of a run, and what ended it early. Without constraints there is one part."""
    parts: list[HybridTrajectory] = []
    length = RESTART if motion.closed else len(times) - 1
    modes = None
    for k in range(0, len(times) - 1, length):
        try:
            part = integrate_hybrid(
                motion, y, times[k : k + length + 1], modes=modes, rtol=tolerance, atol=1e-2 * tolerance
            )
        except BlowUp as end:
            return parts, end
        parts.append(part)
        if not part.complete:
            known = part.ending is Ending.NOT_FINITE and motion.trouble
            return parts, BlowUp(part.last_t, motion.trouble if known else part.ending.value)
        y, modes = (motion.project(part.last_t, part.last_y) if motion.closed else part.last_y), part.last_modes
        if progress is not None:
            progress(part.last_t)
    return parts, None


class Hybrid(Engine):
    """See the module."""

    name = "hybrid"
    run = staticmethod(run)

    def missing(self) -> str:
        """What must be installed for the engine whose equations it takes; "" when all is there."""
        return available(EQUATIONS_OF)

    def refuses(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, constraints: str = "", friction: str = ""
    ) -> str:
        """Refuses what has no events: no dry friction, no held rates."""
        return "" if is_rough(mechanism) or without_holds(scene.laws)[1] else "no dry friction: the same as Pinocchio DOP853"

    def price(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> Price:
        """The price of the factored equations."""
        return EQUATIONS


ENGINES = {"hybrid": Hybrid()}
