"""The reference of a chart, and the errors of a run against it: tracked quantities, energy, loop residuals."""

from __future__ import annotations

import math

import numpy as np

from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.acting import is_rough
from mechlab.experiment.energy import dissipation, energy, energy_finding
from mechlab.experiment.held_rates import without_holds
from mechlab.experiment.recording import Recording, Trace, basic_channels
from mechlab.lab.accuracy.dense import closed_states
from mechlab.lab.methods import METHODS, Problem
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import ConstraintSet, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.studies.named.runs import channel

EVERY = 4
"""Energy and loops are taken at every fourth output time only: each takes the kinematics of the whole tree."""
THRESHOLD = 1e-3
"""Lower bound [m or rad] of the reference value that the relative error e_G divides by."""
LOST = 1e-4
"""Share of the energy turned over by which a reference at tolerance 1e-12 may be off: where it passes a place at which rows repeat each
other, tight steps may meet it and lose energy there."""


@dataclass(frozen=True)
class Score:
    """error: largest deviation of a tracked quantity [m or rad]; e_g: root mean square of the deviations relative to
    max(|reference|, 1e-3) (Gonzalez et al.); energy: largest deviation from the reference's [J]; gap: largest residual
    of loops and relations [m or rad]."""

    error: float
    e_g: float
    energy: float
    gap: float


@dataclass(frozen=True)
class Reference:
    """The reference of a chart: tracked values (n, names), energies [J] at every fourth output time, and `text`, their
    origin.

    own_error: the larger of the differences from a run with a larger tolerance and from the same poses, closed; nan where neither is known.
    """

    names: tuple[str, ...]
    unit: str
    values: Array
    energies: Array
    text: str
    own_error: float


def tracked_names(problem: Problem) -> tuple[str, ...]:
    """The scene's channels in m or rad; without any, the positions of all frames; without frames, all joints."""
    entry, m = problem.design.entry, problem.mechanism
    named = tuple(n for n in problem.scene.channels if n in entry.channels and entry.channels[n][0] in ("m", "rad"))
    frames = tuple(f"{f.name}_{a}" for f in m.frames for a in "xyz")
    return named or frames or m.scalar_names


def tracked(problem: Problem, names: tuple[str, ...], q: Array, v: Array) -> Array:
    """(n, names) values along coordinates q (n, nq)."""
    m = problem.mechanism
    channels, units = basic_channels(m, q, v)
    t = np.linspace(0.0, problem.scene.duration, problem.outputs + 1)[: len(q)]
    bare = Recording(m, t, q, v, channels, units)
    return np.column_stack([channel(problem.design, bare, n) for n in names])


def energies(problem: Problem, q: Array, v: Array) -> Array:
    """Energy [J] at every fourth output time."""
    return energy(problem.mechanism, q[::EVERY], v[::EVERY])


def score(problem: Problem, reference: Reference, trace: Trace) -> Score:
    """Errors of a run against the reference; infinite for a run that ended early or is not finite."""
    if not trace.complete or not np.all(np.isfinite(trace.q)) or len(trace.q) != len(reference.values):
        return Score(math.inf, math.inf, math.inf, math.inf)
    deviation = np.abs(tracked(problem, reference.names, trace.q, trace.v) - reference.values)
    relative = deviation / np.maximum(np.abs(reference.values), THRESHOLD)
    drift = np.abs(energies(problem, trace.q, trace.v) - reference.energies)
    tree, constraints = TreeKinematics(problem.mechanism), ConstraintSet(problem.mechanism)
    open_by = [np.max(np.abs(constraints.residual(tree.set(x))), initial=0.0) for x in trace.q[::EVERY]]
    return Score(float(deviation.max()), float(np.sqrt(np.mean(relative**2))), float(drift.max()), float(max(open_by)))


def reference_of(problem: Problem) -> Reference:
    """A run of the entry's own equations where it has them, else of Pinocchio's rigid dynamics at tolerance 1e-12, with
    located stick-slip events where there is dry friction. Raises MechlabError or NoSolution when neither is
    possible."""
    names = tracked_names(problem)
    entry = problem.design.entry
    unit = "m" if all(n in entry.channels or n.rpartition("_")[2] in ("x", "y", "z") for n in names) else "m or rad"
    if entry.reference is not None:
        found = _own(problem, names, unit)
        if found is not None:
            return found
    return _pinocchio(problem, names, unit)


def _own(problem: Problem, names: tuple[str, ...], unit: str) -> Reference | None:
    """The entry's own reference; None when it does not cover the scene, or has other coordinates or other output
    times."""
    entry, times = problem.design.entry, np.linspace(0.0, problem.scene.duration, problem.outputs + 1)
    assert entry.reference is not None
    try:
        found = entry.reference(problem.design.parameters, problem.scene)
    except (MechlabError, KeyError):
        return None
    at = np.array([int(np.argmin(np.abs(found.t - t))) for t in times])
    same = found.mechanism.nq == problem.mechanism.nq and found.q.shape[1] == problem.mechanism.nq
    if not same or np.max(np.abs(found.t[at] - times)) > 1e-9 * problem.scene.duration:
        return None
    q, v = found.q[at], found.v[at]
    values = tracked(problem, names, q, v)
    text = f"own equations of motion ({found.settings.integrator}, tolerance {found.settings.tolerance:.0e})"
    return Reference(names, unit, values, energies(problem, q, v), text, math.nan)


def _pinocchio(problem: Problem, names: tuple[str, ...], unit: str) -> Reference:
    engine = "hybrid" if is_rough(problem.mechanism) or without_holds(problem.scene.laws)[1] else "pinocchio"
    sharp = next(m for m in METHODS if m.engine == engine and m.integrator == "DOP853")
    why = sharp.available(problem)
    if why:
        raise MechlabError(f"{problem.design.name}: a chart needs own equations or Pinocchio as reference: {why}")
    fine, rough = sharp.run(problem, 1e-12), sharp.run(problem, 1e-10)
    if not fine.complete or not rough.complete:
        raise NoSolution(
            f"{problem.design.name}: the reference run does not reach the end: {fine.reason or rough.reason}."
        )
    _refuse_lost_energy(problem, fine)
    values = tracked(problem, names, fine.q, fine.v)
    # where loops all but lose rows, poses that are a little open may be far from closed ones
    others = (rough.q, rough.v), closed_states(problem.mechanism, fine.q, fine.v)
    own_error = max(float(np.max(np.abs(values - tracked(problem, names, *x)))) for x in others)
    text = "Pinocchio's rigid dynamics (DOP853, tolerance 1e-12)"
    if engine == "hybrid":
        text = "Pinocchio's rigid dynamics with located events of friction (hybrid, DOP853, tolerance 1e-12)"
    return Reference(names, unit, values, energies(problem, fine.q, fine.v), text, own_error)


def _refuse_lost_energy(problem: Problem, run: Trace) -> None:
    """Raise NoSolution for a reference under no laws and without dry friction whose energy does not balance."""
    m = problem.mechanism
    if problem.scene.laws or is_rough(m):
        return
    t = np.linspace(0.0, problem.scene.duration, len(run.q))
    lost = energy_finding(m, t, run.q, run.v, -dissipation(m, run.q, run.v)).value
    if lost > LOST:
        raise NoSolution(
            f"{problem.design.name}: there is no reference to compare with: Pinocchio's sharpest run has no account of {lost:.2g} of its "
            "energy, as past a place where assembly modes meet; take a shorter duration or another scene."
        )
