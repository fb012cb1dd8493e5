"""Checks of the closed differential: closed forms, Pinocchio and MuJoCo, in every fidelity.

First the helpers, which the claims use too: the example with both tooth sets, runs, the lag of soft gear rows.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.build import GAP, STATED_TEETH, USED_TEETH, WIDTH, Parameters, build
from mechlab.catalog.closed_differential.questions import ANSWERS, QUESTIONS, Machine, machine, reference
from mechlab.catalog.closed_differential.scenes import SCENES
from mechlab.engines.protocol import IMPLEMENTATIONS, engine
from mechlab.engines.protocol import WITNESSES as ENGINES
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.held_rates import captured
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import PRESETS, Settings
from mechlab.kit.epicyclic_build import FIDELITIES
from mechlab.kit.epicyclic_checks import mesh_check
from mechlab.kit.epicyclic_mass import TURN, moving_check, wheel
from mechlab.kit.mass_check import NOTHING, State
from mechlab.mechanism import TreeKinematics
from mechlab.mechanism.geometry import Array

LAB = Parameters()
EXAMPLE = {"used teeth": replace(LAB, teeth=USED_TEETH), "stated teeth": replace(LAB, teeth=STATED_TEETH)}
"""The source's numeric example, with the teeth that its computation uses and with those that it states."""
SOLVERS = ("analytic", *ENGINES)
FIDELITY = {"pinocchio": "parts", "mujoco": "minimal"}
"""Fidelity in which an engine is asked to run: Pinocchio with the gear rows, MuJoCo without soft rows."""


def answers(p: Parameters, **given: float) -> dict[str, dict[str, Any]]:
    """Witness -> values of the question."""
    measured = {name: ask(p, given) for name, ask in QUESTIONS[0].witnesses.items()}
    return {name: answer.values for name, answer in measured.items() if not answer.cannot}


def machines(p: Parameters, fidelity: str = "parts") -> dict[str, Machine]:
    """Witness -> its mass matrix and gear rows; the numpy tree stands for the closed form."""
    return {name: machine(name, p, fidelity) for name in IMPLEMENTATIONS}


def run(
    who: str, p: Parameters, scene: str, duration: float | None = None, fidelity: str | None = None,
    timestep: float | None = None,
) -> Recording:  # fmt: skip
    """A run of a scene with the parameters as they are, by "analytic" or an engine; with its own timestep [s] or another, with which
    the capture time of held rates is scaled."""
    level = fidelity or FIDELITY.get(who, "minimal")
    made = SCENES[scene].make(p, level)
    return _run(who, p, scene, duration or made.duration, level, timestep or made.settings.timestep)


@lru_cache(maxsize=32)
def _run(who: str, p: Parameters, scene: str, duration: float, level: str, timestep: float) -> Recording:
    """Several checks look at the same run: it is made once."""
    made = replace(SCENES[scene].make(p, level), duration=duration)
    if who == "analytic":
        return reference(p, made)
    made = replace(made, laws=captured(made.laws, timestep / made.settings.timestep))
    settings = replace(made.settings, engine=who, integrator="RK4", timestep=timestep)
    return engine(who).run(build(p, level), made, settings)


def speeds(recording: Recording) -> tuple[float, float]:
    """Final w_H1, w_H2."""
    return float(recording.channel("H1_rate")[-1]), float(recording.channel("H2_rate")[-1])


def outer_power(p: Parameters, recording: Recording) -> Array:
    """(n,) M_H1 w_H1 - M_H2 w_H2 [W] along a run."""
    return p.M_H1 * recording.channel("H1_rate") - p.M_H2 * recording.channel("H2_rate")


def rounded(values: Any, digits: int = 10) -> Any:
    """Numbers as plain lists, rounded, without negative zeros."""
    return (np.round(np.asarray(values, dtype=float), digits) + 0.0).tolist()


LAG_LIMIT = 1e-3
"""Lag [rad] above which a warning is given."""


def predicted_lag(p: Parameters, fidelity: str, settings: Settings | None = None) -> dict[str, float]:
    """Relation -> predicted |residual| [rad of the wheel it turns] under M_H1 and M_H2 with rows as soft as `settings`
    (default: the preset `accurate`) make them, in the fidelity "parts" or "full"."""
    chosen = settings or PRESETS["accurate"]
    solref, solimp = chosen.solref or (0.02, 1.0), chosen.solimp or (0.9, 0.95, 0.001, 0.5, 2.0)
    count = p.bodies(fidelity)
    masses, force = [p.J14, p.J36], [0.0, 0.0]  # of absolute speeds: the blocks, then each carrier and its planets
    meshes: dict[str, dict[int, float]] = {}
    for s, moment in zip(p.stages, (p.M_H1, -p.M_H2), strict=True):
        (sun, pinion, ring), arm = s.teeth, len(masses)
        masses += [s.carrier_inertia + s.planets * s.planet_mass * s.radius**2, *count * [s.planet_inertia * s.planets / count]]
        force += [moment, *count * [0.0]]
        for k in range(1, count + 1):
            for block, ratio in enumerate((pinion / sun, -pinion / ring)):  # Willis: w_block - w_H = -ratio (w_planet - w_H)
                meshes[f"{s.meshes[block]}_{k}"] = {block: 1.0, arm: -1.0 - ratio, arm + k: ratio}
    rows = np.array([[row.get(k, 0.0) for k in range(len(masses))] for row in meshes.values()])
    lag = closed.predicted_lag(np.diag(masses), rows, force, solref[0], solimp[1], solref[1])
    return dict(zip(meshes, lag.tolist(), strict=True))


def warnings(p: Parameters) -> tuple[str, ...]:
    """Sentences on doubtful parameters: lag of soft rows, planets that cannot stand evenly or touch each other."""
    out = []
    for fidelity in ("parts", "full"):
        lag = predicted_lag(p, fidelity)
        worst = max(lag, key=lambda name: lag[name])
        if not lag[worst] <= LAG_LIMIT:
            out.append(
                f"in fidelity {fidelity!r} MuJoCo's soft rows are predicted to lag by {lag[worst]:.3g} rad at {worst} "
                f"(limit {LAG_LIMIT:g}): light parts under load; take fidelity 'minimal', which has no rows"
            )
    for k, (stage, found) in enumerate(zip(p.stages, closed.conditions(p.train, p.planets), strict=True), 1):
        sun, planet, ring = stage.teeth
        if not found.even:
            out.append(
                f"stage {k}: {p.planets} planets cannot stand at equal angles, ({sun} + {ring})/{p.planets} is not "
                "whole; they are drawn at the nearest angles at which the teeth fit"
            )
        if not found.neighbours:
            out.append(f"stage {k}: {p.planets} planets of {planet} teeth touch each other; take fewer")
    return tuple(out)


SPEEDS = (1.3, -0.6)
"""Speeds of both carriers [rad/s]; those of the blocks where both carriers turn as one."""


def state(p: Parameters, fidelity: str) -> State | None:
    """The state in particles in which every member has turned by TURN x its speed; None for `minimal` where both
    carriers turn as one. A carrier's mass lies at the radius of its planet axes, a block's at that of H1. Planets that
    are not bodies belong to the carrier; in `parts` one planet a stage has the spin inertia of all."""
    rays = p.bodies(fidelity)
    if not (p.train.regular or rays):
        return None
    named = ("w_H1", "w_H2") if p.train.regular else ("w1", "w3")
    x = closed.speeds(p.train, **dict(zip(named, SPEEDS, strict=True)))
    rates = {"H1": float(x.w_H1), "H2": float(x.w_H2), "block_14": float(x.w1), "block_36": float(x.w3)}
    spins = {"planet_2": float(x.w2), "planet_5": float(x.w5)}
    parts, energy = NOTHING, 0.0
    for stage, kind, bare, mass, spin in ((1, "planet_2", p.J_H1, p.m2, p.J2), (2, "planet_5", p.J_H2, p.m5, p.J5)):
        carrier, radius = rates[f"H{stage}"], p.radii[stage - 1]
        moment = bare + (p.planets - rays) * mass * radius**2
        parts = parts + wheel(moment / radius**2, moment, carrier)
        own = spin * (p.planets if rays == 1 else 1)
        for k in range(rays):
            at = _seat(p, stage, k, TURN * carrier)
            parts = parts + wheel(mass, own, spins[kind], at, carrier)
            rates[f"{kind}_{k + 1}"] = spins[kind] - carrier
        rates[f"{kind}_spin"] = spins[kind]
        energy += 0.0 if rays else 0.5 * p.planets * spin * spins[kind] ** 2
    for block, moment in (("block_14", p.J14), ("block_36", p.J36)):
        if rays:
            parts = parts + wheel(moment / p.radii[0] ** 2, moment, rates[block])
        else:
            energy += 0.5 * moment * rates[block] ** 2
    rates["H2_on_H1"] = rates["H2"] - rates["H1"]
    return State({n: TURN * w for n, w in rates.items()}, rates, parts, {}, (0.0, 0.0, 0.0), 2, energy)


def _seat(p: Parameters, stage: int, k: int, turned: float) -> Array:
    """(3,) centre of planet k [m] on a carrier that has turned by `turned` [rad], placed as `azimuth` does."""
    sun, ring = (p.teeth[0], p.teeth[2]) if stage == 1 else (p.teeth[3], p.teeth[5])
    angle = 2.0 * math.pi * round(k * (sun + ring) / p.planets) / (sun + ring) + turned
    height = 0.0 if stage == 1 else (WIDTH + GAP) * p.module
    return np.array([p.radii[stage - 1] * math.cos(angle), p.radii[stage - 1] * math.sin(angle), height])


def _speeds(p: Parameters) -> CheckResult:
    measured = answers(p, w_H1=100.0, w_H2=37.0)
    keys = [k for k in ANSWERS if k != "w_H2" and all(k in v for v in measured.values())]
    scale = np.maximum(1.0, [abs(float(measured["analytic"][k])) for k in keys])
    values = {who: np.array([float(v[k]) for k in keys]) / scale for who, v in measured.items()}
    return CheckResult(values, 1e-9, note=f"relative; {', '.join(keys)}")


def _mass(p: Parameters) -> CheckResult:
    expected = closed.mass_matrix(p.train, p.inertias)
    scale = np.abs(expected).max()
    measured = {}
    for fidelity in FIDELITIES:
        for who, made in machines(p, fidelity).items():
            basis = np.column_stack([made.rates({"w1": 1.0, "w3": 0.0}), made.rates({"w1": 0.0, "w3": 1.0})])
            measured[f"{who} {fidelity}"] = basis.T @ made.mass @ basis / scale
    return CheckResult(measured, 1e-12, expected / scale, "mass matrix in (w1, w3), relative to its largest entry")


MEMBERS = ("H1", "H2", "block_14", "block_36")


def _final(recording: Recording) -> Array:
    return np.array([recording.channel(f"{n}_rate")[-1] for n in MEMBERS])


def _end(recording: Recording) -> Array:
    """Time, angles and rates at the end."""
    return np.array([recording.t[-1], *(recording.channel(n)[-1] for n in MEMBERS), *_final(recording)])


def _constant(p: Parameters) -> CheckResult:
    expected = _end(run("analytic", p, "constant-moments"))
    measured = {f"{who} {f}": _end(run(who, p, "constant-moments", fidelity=f)) for who in ENGINES for f in FIDELITIES}
    # RK4 is exact for constant accelerations; MuJoCo's soft rows start with a transient of 1e-9 of the speeds, 2e-6 rad.
    note = "time, angles and speeds of H1, H2 and both blocks after 0.5 s of constant moments"
    return CheckResult(measured, 1e-5, expected, note)


def _scenes(p: Parameters) -> CheckResult:
    expected: list[Array] = []
    measured: dict[str, list[Array]] = {"mujoco minimal": [], "mujoco parts": []}
    for name in ("held-input-dry-load", "one-way-stop", "locked-pair", "internal-drag"):
        design = replace(p, **SCENES[name].overrides)
        if name == "locked-pair":  # the pair is closed before it is locked
            start = closed.speeds(p.train, w1=float(p.lock_ratio), w3=1.0)
            factor = p.w_H1_0 / float(start.w_H1)
            design = replace(design, w_H2_0=factor * float(start.w_H2))
        expected.append(_final(run("analytic", design, name)))
        for who in measured:
            measured[who].append(_final(run("mujoco", design, name, fidelity=who.split()[1])))
    # A rate is caught within some steps of 0.5 or 1 ms, which shifts later speeds by less than 1e-4 rad/s.
    return CheckResult({k: np.array(v) for k, v in measured.items()}, 1e-3, np.array(expected), "final speeds [rad/s]")


def mesh_powers(p: Parameters, who: str) -> Array:
    """(n, meshes) power [W] that both gears and the carrier put into each mesh, in a run under constant moments;
    without the first 50 ms, in which soft rows take up their load."""
    found = run(who, p, "constant-moments", fidelity="parts")
    m, late = found.mechanism, found.t > 0.05
    rates = [sum(float(c) * found.channel(f"{n}_rate") for n, c in r.coefficients) for r in m.relations]
    loads = [found.channel(f"{r.name}_load") for r in m.relations]
    return np.column_stack([load * rate for load, rate in zip(loads, rates, strict=True)])[late]


def _powers(p: Parameters) -> CheckResult:
    outer = p.M_H1 * abs(p.w_H1_0) + abs(p.M_H2 * p.w_H2_0) + 1.0
    measured = {who: float(np.abs(mesh_powers(p, who)).max()) / outer for who in ENGINES}
    # What is left of the soft rows' transient after 25 of its time constants is rounding.
    note = "power in + out + carrier of every mesh, relative to the outer powers at the start"
    return CheckResult(measured, 1e-9, 0.0, note)


def angular_momentum(recording: Recording) -> Array:
    """(n,) angular momentum about the axis [N m s] of a run in parts or full, part by part from the bodies' twists."""
    m = recording.mechanism
    tree = TreeKinematics(m)
    out = np.zeros(len(recording.t))
    for k, (q, v) in enumerate(zip(recording.q, recording.v, strict=True)):
        tree.set(q, v)
        for body in m.bodies:
            rotation, origin = tree.pose(body.name)
            centre = origin + rotation @ np.array(body.inertia.com)
            twist = tree.velocity(body.name, centre)
            spin = rotation @ body.inertia.matrix() @ rotation.T @ twist[3:]
            out[k] += spin[2] + body.inertia.mass * (centre[0] * twist[1] - centre[1] * twist[0])
    return out


def _momentum(p: Parameters) -> CheckResult:
    design = replace(p, drag_internal=max(p.drag_internal, 0.5), drag_14=0.0, drag_36=0.0)
    measured = {}
    for who in ENGINES:
        found = run(who, design, "internal-drag", 0.5, "full")
        momentum = angular_momentum(found)
        gained = momentum - momentum[0]
        measured[f"{who} full"] = float(np.abs(gained - (design.M_H1 - design.M_H2) * found.t).max())
    return CheckResult(measured, 1e-8, 0.0, "largest |dL - (M_H1 - M_H2) t| with drag between the blocks [N m s]")


def _lag(p: Parameters) -> CheckResult:
    predicted = predicted_lag(p, "parts")
    found = run("mujoco", p, "constant-moments", 0.1, "parts")
    m = found.mechanism
    measured = np.array([abs(m.coefficient_row(r.coefficients) @ found.q[-1]) for r in m.relations])
    expected = np.array([predicted[r.name] for r in m.relations])
    if not np.all(expected > 0.0):
        return CheckResult({"mujoco": measured}, 1e-12, expected, "residual of each mesh [rad]; not all carry load")
    note = "residual of each mesh over the predicted one"
    return CheckResult({"mujoco": measured / expected}, 0.01, np.ones(len(expected)), note)


CHECKS = (
    Check("D1", "speeds, moments and accelerations from three witnesses", _speeds, "Willis; virtual work"),
    Check("D2", "mass matrix of each fidelity against the closed form", _mass, "Lagrange"),
    Check("D3", "constant moments in every fidelity and engine", _constant, "linear motion, exact"),
    Check("D4", "dry load, stop, lock and inner drag against exact events", _scenes, "matrix exponentials between events",
          slow=True),
    Check("D5", "power balance of every mesh on a moving carrier", _powers, "no mesh stores or loses energy"),
    Check("D6", "angular momentum under friction inside the train", _momentum, "only the housing can change it"),
    Check("D7", "lag of soft rows against the law r = (1-d) tc^2 A f", _lag, "MuJoCo's soft constraints at quasi-rest"),
    moving_check("D8", build, state),
    mesh_check("D9", build, meshes=4, wheels=2),
)  # fmt: skip
