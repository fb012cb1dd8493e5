"""Engine `hybrid`: equations from Pinocchio, dry friction of joints and shafts integrated as it is, with events.

Equations of a mechanism with set-valued dry friction: a stuck element is one more constraint row.

The Recording of a hybrid run: channels, health, and how often what stuck.

The run: DOP853 between located events, in parts that start on the constraints.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.equations import BlowUp, Equations, Instant
from mechlab.engines.pinocchio.kkt import dense, factor
from mechlab.engines.pinocchio.reactions import channels
from mechlab.engines.pinocchio.runner import versions
from mechlab.errors import MechlabError
from mechlab.experiment.energy import energy_finding
from mechlab.experiment.findings import kinematic_findings, sample_grid, saturation_finding
from mechlab.experiment.laws import Law, applied_force
from mechlab.experiment.recording import Cost, Finding, Health, Recording
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.integrate import Ending, HybridTrajectory, Modes, count_work, integrate_hybrid
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


class RoughEquations(Equations):
    """Equations of a mechanism with set-valued dry friction: a `mechlab.integrate.RoughProblem`.

    A sliding element carries -mode limit; a stuck one is one more constraint row, rate = 0, whose reaction is its
    friction force. Work and everything else as in `Equations`.
    """

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> None:
        super().__init__(mechanism, laws, 0.0)
        self.rows = self.plant.passive.friction_rows
        self.limits = self.plant.passive.friction
        size = mechanism.nq + mechanism.nv + len(self.memory) + 1
        self.rates = np.zeros((len(self.limits), size))
        self.rates[:, mechanism.nq : mechanism.nq + mechanism.nv] = self.rows
        self.modes: Modes = tuple(0 for _ in self.limits)
        self._friction = np.zeros(len(self.limits))
        self.trouble = ""

    def instant(self, t: float, y: Array) -> Instant:
        """Accelerations, reactions and forces at a state in the present modes."""
        count_work(self.price)
        plant = self.move(t, y)
        try:
            force, by_name = applied_force(self.mechanism, self.laws, t, plant)
            a, reactions, friction = self._solve(force)
        except (MechlabError, np.linalg.LinAlgError, OverflowError, ZeroDivisionError) as problem:
            raise BlowUp(t, str(problem)) from problem
        if not np.all(np.isfinite(a)):
            raise BlowUp(t, "the accelerations are not finite (is a law's force not finite?)")
        self._friction = friction
        power = float((force + self.rows.T @ friction) @ plant.v) - plant.passive.loss(plant.kin, plant.v)
        return Instant(a, reactions, by_name, power)

    def _solve(self, force: Array) -> tuple[Array, Array, Array]:
        """Accelerations, reactions of the constraint rows, friction forces (k,)."""
        plant = self.plant
        modes = np.array(self.modes, dtype=float)
        friction = -modes * self.limits
        stuck = modes == 0.0
        if not stuck.any():
            a, r = plant.accelerations(force + self.rows.T @ friction)
            return a, r, friction
        plant.evaluations += 1
        held = self.rows[stuck]
        jacobian, count = plant.jacobian(), len(plant.constraints)
        rows = np.vstack([jacobian, held]) if count else held
        bias = np.concatenate([plant.constraint_bias() if count else np.zeros(0), np.zeros(len(held))])
        net = force + self.rows.T @ friction - plant.bias()
        factors = factor(plant.mass_matrix(), rows)
        a, r = factors.accelerations(net, bias) if factors else dense(plant.mass_matrix(), rows, net, bias)[:2]
        friction[stuck] = r[count:]
        return a, r[:count], friction

    def slope(self, t: float, y: Array, modes: Modes | None = None) -> Array:
        """dy/dt in these modes; not a number where the equations have no answer, `trouble` says why."""
        if modes is not None:
            self.modes = modes
        try:
            return super().slope(t, y)
        except BlowUp as trouble:
            self.trouble = trouble.reason
            return np.full(len(y), np.nan)

    def holding(self, t: float, y: Array, modes: Modes) -> Array:
        """(k,) friction forces in these modes."""
        self.modes = modes
        self.instant(t, y)
        return self._friction

    def settle(self, t: float, y: Array, modes: Modes) -> Array:
        """The state with the rates of stuck elements zero: the smallest change of rates, measured by the kinetic energy."""
        y = self.project(t, y)
        plant = self.move(t, y)
        held = self.rows[np.array(modes) == 0]
        rows = np.vstack([plant.jacobian(), held]) if len(plant.constraints) else held
        factors = factor(plant.mass_matrix(), rows)
        if factors is not None:
            self.split(y)[1][:] += factors.correction(rows @ plant.v)
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
    found, units = channels(motion.plant, t, q, v, instants)
    findings = list(kinematic_findings(mechanism, q, v))
    findings.append(
        energy_finding(mechanism, t, q, v, np.array([x.power for x in instants]), y[:, -1], laws=scene.laws)
    )
    forces = {n: found[f"{n}_force"] for n in mechanism.scalar_names if f"{n}_force" in found}
    limited = saturation_finding(scene.laws, forces)
    if limited is not None:
        findings.append(limited)
    findings.append(_friction(motion, parts))
    if end is not None:
        text = f"the run stopped at t = {end.t:.6g} s of {scene.duration:g} s: {end.reason}"
        findings.insert(0, Finding("blow_up", end.t, scene.duration, "s", "error", text))
    evaluations = sum(p.evaluations for p in parts)
    return Recording(
        mechanism=mechanism, t=t, q=q, v=v, channels=found, units=units, health=Health(tuple(findings)),
        cost=Cost(spent, sum(p.steps for p in parts), evaluations), settings=replace(settings, integrator="DOP853"),
        scene=scene.name, name=mechanism.name, fidelity=scene.fidelity, versions=versions(),
    )  # fmt: skip


def _friction(motion: RoughEquations, parts: list[HybridTrajectory]) -> Finding:
    """How often what stuck, and for how long."""
    names = motion.plant.passive.friction_names
    if not names:
        return Finding("friction", 0.0, 0.0, "events", "ok", "no dry friction: plain DOP853")
    stuck = np.sum([p.stuck_time for p in parts], axis=0)
    events = sum(len(p.events) for p in parts)
    spans = ", ".join(f"{n} stood still for {float(s):.6g} s" for n, s in zip(names, stuck, strict=False))
    text = f"dry friction was followed through {events} events without smoothing; {spans}"
    return Finding("friction", float(events), 0.0, "events", "ok", text)


RESTART = 20
"""A mechanism with loops or gears is projected onto them after so many samples."""


def run(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings | None = None,
    sample_times: ArrayLike | None = None,
    *,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """A run of the scene with exact dry friction: DOP853 between located events, relative `settings.tolerance`.

    Finding "friction" counts the events and the time each joint or shaft stood still; a run that cannot go on ends
    there with the finding "blow_up" (error). Raises MechlabError for bad input, NoSolution when the start does not close.
    """
    chosen = settings or Settings(engine="hybrid", integrator="DOP853")
    times = sample_grid(scene.duration, min(chosen.timestep, scene.duration / 200.0), sample_times)
    q, v = initial_state(mechanism, scene)
    motion = RoughEquations(mechanism, scene.laws)
    began = time.thread_time()
    parts, end = _integrate(motion, times, motion.start(q, v), chosen.tolerance, progress)
    spent = time.thread_time() - began
    return recording_of(mechanism, scene, chosen, motion, parts, end, spent)


def _integrate(
    motion: RoughEquations, times: Array, y: Array, tolerance: float, progress: Callable[[float], None] | None
) -> tuple[list[HybridTrajectory], BlowUp | None]:
    """All parts of a run, and what ended it early. Without constraints there is one part."""
    parts: list[HybridTrajectory] = []
    closed = len(motion.plant.constraints) > 0 or bool(motion.quaternions)
    length = RESTART if closed else len(times) - 1
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
        y, modes = (motion.project(part.last_t, part.last_y) if closed else part.last_y), part.last_modes
        if progress is not None:
            progress(part.last_t)
    return parts, None
