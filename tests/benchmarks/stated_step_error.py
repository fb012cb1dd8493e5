"""Random runs with fixed steps, half of them with a late event: does the error that a run states bound the true one, and how far
is it above?

    python -m tests.benchmarks.stated_step_error [cases] [first seed]

The truth is the same run at a tenth of the timestep (captures of held rates and motors scaled with it, as the run's own
estimate has them). Even seeds: scenes of the catalog with random parameters, random chains and four-bars. Odd seeds: a slow pass
over the top, a fold, the end of a range, dry friction that sticks, a fast motor or servo, a stop, held rates, saturation, each
in the later part of the run. A line for each case with the ratio stated / true of the positions and the worst of the
channels; then counts: too small (below a third of the true error), too large (above ten times), right. Errors below FLOOR of
the size of a channel are rounding, and not counted.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import mechlab as ml
from mechlab import catalog
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.errors import largest_difference, shared_times
from mechlab.experiment.held_rates import HeldRates, RateHold, captured
from mechlab.experiment.laws import ConstantPower, DcMotor, Harmonic, Law, Motor, OneSidedStop, Servo, Viscous
from mechlab.experiment.motion import Sine
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings, preset
from mechlab.lab.problem_settings import settings_for, with_static_motors
from mechlab.lab.step_error import with_step_error
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute
from tests.benchmarks.stated_errors import drawn

FLOOR = 1e-12
TOO_SMALL, TOO_LARGE = 1.0 / 3.0, 10.0
FINER = 10.0
CATALOG = ("fourbar", "slider_crank", "n_fourbar", "pendulum", "flyball", "bricard", "stephenson", "quick_return", "fivebar",
           "gear_linkage", "closed_differential", "planetary_stage", "prosthetic_leg", "impulse_transmission")  # fmt: skip
"""Entries whose scenes take no more than seconds."""
STEPS = {"mujoco": 2500, "pinocchio": 600}
"""Runs are cut to so many steps."""


@dataclass(frozen=True)
class Outcome:
    """Stated over true error of the positions, and of each channel that is above rounding; NaN: rounding."""

    line: str
    positions: float
    channels: dict[str, float]


def chain(rng: np.random.Generator, links: int, **last: object) -> Mechanism:
    """A chain of pendulums with random masses; `last`: options of the first joint."""
    b = Builder("chain", gravity=(0.0, -9.81, 0.0))
    parent, at = "ground", (0.0, 0.0, 0.0)
    for k in range(links):
        length = float(rng.uniform(0.2, 0.6))
        options = {"damping": float(rng.choice([0.0, 0.02]))} | (dict(last) if k == 0 else {})
        b.body(f"link_{k}", revolute(f"q{k}", "z", **options), parent=parent, at=at,
               inertia=Inertia.point(float(rng.uniform(0.3, 2.0)), (length, 0.0, 0.0)) + Inertia.axial(0.05, 1e-3, 1e-3))  # fmt: skip
        parent, at = f"link_{k}", (length, 0.0, 0.0)
    b.frame("tip", parent, at)
    return b.build()


def _chain_case(rng: np.random.Generator) -> tuple[Mechanism, Scene]:
    links = int(rng.integers(1, 4))
    start = {f"q{k}": float(rng.uniform(-1.2, 0.4)) for k in range(links)}
    laws: tuple[Law, ...] = (
        () if rng.random() < 0.5 else (Harmonic("q0", float(rng.uniform(0.5, 4)), float(rng.uniform(1, 12))),)
    )
    return chain(rng, links), Scene("chain", "full", float(rng.uniform(0.5, 3.0)), laws, start)


def _over_the_top(rng: np.random.Generator) -> tuple[Mechanism, Scene]:
    """From the bottom with barely the speed for the top, or barely not."""
    m = chain(rng, 1)
    length = float(np.linalg.norm(m.bodies[0].inertia.com))
    need = math.sqrt(4.0 * 9.81 * length)
    rate = need * (1.0 + float(rng.choice([-1, 1])) * 10 ** float(rng.uniform(-6, -2)))
    return m, Scene("top", "full", float(rng.uniform(1.5, 3.0)), (), {"q0": -0.5 * math.pi}, {"q0": rate})


def _range(rng: np.random.Generator) -> tuple[Mechanism, Scene]:
    """It falls onto the end of its range after a swing."""
    links = int(rng.integers(1, 3))
    m = chain(rng, links, range=(-math.pi, float(rng.uniform(-1.3, 0.0))))
    start = {"q0": float(rng.uniform(-3.0, -2.6))}
    return m, Scene("range", "full", float(rng.uniform(0.6, 1.2)), (), start)


def _stick(rng: np.random.Generator) -> tuple[Mechanism, Scene]:
    """Dry friction stops it late."""
    m = chain(rng, 1, friction=float(rng.uniform(0.3, 2.0)))
    return m, Scene("stick", "full", float(rng.uniform(0.6, 2.0)), (), {"q0": float(rng.uniform(-1.4, 0.3))})


def _motor(rng: np.random.Generator) -> tuple[Mechanism, Scene]:
    """A motor whose lag is near the step, or a steep or stiff drive."""
    m = chain(rng, int(rng.integers(1, 3)))
    kind = int(rng.integers(4))
    law: Law
    if kind == 0:
        law = DcMotor("q0", 12.0, float(rng.uniform(0.2, 1.0)), 1.0, 10 ** float(rng.uniform(-4.5, -2)))
    elif kind == 1:
        law = Motor("q0", 10 ** float(rng.uniform(0.5, 2)), float(rng.uniform(2, 30)))
    elif kind == 2:
        sine = Sine(float(rng.uniform(0.2, 1)), float(rng.uniform(2, 10)), offset=-1.0)
        law = Servo("q0", sine, 10 ** float(rng.uniform(1, 4)), 10 ** float(rng.uniform(0, 2)))
    else:
        sine = Sine(float(rng.uniform(0.2, 1)), float(rng.uniform(2, 10)), offset=-1.0)
        law = Servo(
            "q0", sine, 10 ** float(rng.uniform(1, 3)), 10 ** float(rng.uniform(0, 1)), limit=float(rng.uniform(3, 20))
        )
    return m, Scene("motor", "full", float(rng.uniform(0.5, 1.5)), (law,), {"q0": -1.0})


def _stop(rng: np.random.Generator) -> tuple[Mechanism, Scene]:
    """A springy stop on the other side of the swing, or a load of constant power that reaches its limit."""
    m = chain(rng, int(rng.integers(1, 3)))
    law: Law = OneSidedStop(
        "q0", float(rng.uniform(-2.0, -1.0)), -1, 10 ** float(rng.uniform(2, 5)), float(rng.uniform(0, 10))
    )
    if rng.random() < 0.25:
        law = ConstantPower("q0", float(rng.uniform(-20, 20)), float(rng.uniform(2, 8)))
    return m, Scene("stop", "full", float(rng.uniform(0.6, 1.5)), (law,), {"q0": 0.0})


def _held(rng: np.random.Generator, h: float) -> tuple[Mechanism, Scene]:
    """Friction that truly sticks, by held rates."""
    m = chain(rng, 1)
    bound = float(rng.uniform(0.5, 3.0))
    law = HeldRates((RateHold("q0", 0.0, -bound, bound),), (Viscous("q0", 0.05),), time=h)
    return m, Scene("held", "full", float(rng.uniform(0.6, 1.5)), (law,), {"q0": float(rng.uniform(-1.4, 0.3))})


LATE: tuple[Callable[..., tuple[Mechanism, Scene]], ...] = (_over_the_top, _range, _stick, _motor, _stop)


def case(seed: int) -> Outcome | None:
    """One run, what it states, and what is true; None for a draw that a mechanism refuses or a run that says it failed."""
    rng = np.random.default_rng([seed, 12])
    engine = "pinocchio" if rng.random() < 0.3 else "mujoco"
    h = float(rng.choice([5e-4, 1e-3, 2e-3, 4e-3] if engine == "mujoco" else [1e-3, 2e-3, 4e-3]))
    late = seed % 2 == 1
    name = f"{seed:4d} "
    try:
        if late and rng.random() < 0.7:
            if rng.random() < 0.12:
                m, scene = _held(rng, h)
            else:
                m, scene = LATE[int(rng.integers(len(LATE)))](rng)
            settings = Settings(engine=engine, timestep=h)
        elif not late and rng.random() < 0.4:
            m, scene = _chain_case(rng)
            integrator = (
                "RK4"
                if rng.random() < 0.7 or engine != "mujoco"
                else str(rng.choice(["implicitfast", "Euler", "discrete"]))
            )
            settings = Settings(engine=engine, timestep=h, integrator=integrator)
        else:
            entry, given = _entry(rng, late)
            lived = ml.load(entry, **given)
            plan = str(rng.choice(list(lived.entry.scenes)))
            lived = lived.for_scene(plan)
            scene = lived.scene(plan)
            scene = replace(scene, duration=min(scene.duration, 6.0 if late else 1.5))
            m = lived.mechanism(scene.fidelity)
            base = scene.settings if scene.settings.engine == engine else preset("accurate", engine=engine)
            base = settings_for(base, m, scene) if engine == "mujoco" else base
            settings = replace(base, timestep=base.timestep * float(rng.choice([0.5, 1.0, 2.0])))
            name += f"{entry} {given} "
        if settings.engine == "mujoco" and rng.random() < 0.5:
            settings = replace(settings_for(settings, m, scene), timestep=settings.timestep)
        return _measured(name, m, scene, settings)
    except MechlabError as why:
        print(f"{name} refused: {str(why)[:90]}")
        return None


def _entry(rng: np.random.Generator, late: bool) -> tuple[str, dict[str, float]]:
    """A catalog entry and parameters; late: a pass over the top, a fold, or dry friction."""
    if not late:
        name = str(rng.choice(CATALOG))
        return name, drawn(rng, catalog.entry(name))
    kind = int(rng.integers(3))
    if kind == 0:
        more = {"rocker_mass": float(rng.uniform(0.5, 2)), "coupler_mass": float(rng.uniform(0.3, 1.5))}
        return "n_fourbar", {"N": int(rng.integers(1, 8)), "start_speed": float(rng.uniform(0.2, 2.0)), **more}
    if kind == 1:  # near a change point: crank + ground = coupler + rocker
        crank = float(rng.uniform(0.1, 0.2))
        return "fourbar", {
            "crank": crank,
            "rocker": crank * (1.0 + 10 ** float(rng.uniform(-4, -1))),
            "coupler": 0.3,
            "ground": 0.3,
        }
    return "impulse_transmission", drawn(rng, catalog.entry("impulse_transmission"))


def _measured(name: str, m: Mechanism, scene: Scene, settings: Settings) -> Outcome | None:
    scene = with_static_motors(scene, settings)
    scene = replace(scene, duration=min(scene.duration, STEPS[settings.engine] * settings.timestep))
    done = engine(settings.engine).run(m, scene, settings)
    name += f"{scene.name} {settings.engine} {settings.integrator} h={settings.timestep:g} T={scene.duration:.3g}"
    if not done.health.trusted:
        print(f"{name} says that it failed: {next(f.name for f in done.health.findings if f.severity == 'error')}")
        return None
    stated = with_step_error(done, scene)
    truth = engine(settings.engine).run(
        m,
        replace(scene, laws=captured(scene.laws, 1.0 / FINER)),
        replace(settings, timestep=settings.timestep / FINER),
        done.t,
    )
    if truth.t[-1] < done.t[-1] * (1.0 - 1e-9):
        print(f"{name}: the finer run does not come through")
        return None
    finding = stated.health.finding("step_error")
    mine, theirs = shared_times(done, truth)
    error = max(largest_difference(done.q[mine, k], truth.q[theirs, k]) for k in range(m.nq))
    channels = {n: _ratio(stated, truth, n) for n in stated.errors}
    positions = _over(finding.value, error, 1.0)
    counted = {n: x for n, x in channels.items() if not math.isnan(x)}
    least = min(counted, key=lambda n: counted[n], default="")
    line = f"{name}: positions {finding.value:.2g} / {error:.2g} = {positions:.3g}; channels"
    line += f" at least {counted.get(least, math.nan):.3g} ({least})"
    return Outcome(line, positions, counted)


def _ratio(stated: Recording, truth: Recording, name: str) -> float:
    mine, theirs = shared_times(stated, truth)
    values = stated.channels[name]
    error = largest_difference(values[mine], truth.channels[name][theirs])
    return _over(stated.errors[name], error, max(1.0, float(np.max(np.abs(values)))))


def _over(stated: float, error: float, size: float) -> float:
    if stated < FLOOR * size or error < FLOOR * size:
        return math.nan
    return stated / error


def counted(ratios: list[float], what: str) -> str:
    """A sentence on stated over true errors."""
    real = np.array([x for x in ratios if not math.isnan(x)])
    small, large = int(np.sum(real < TOO_SMALL)), int(np.sum(real > TOO_LARGE))
    n = max(1, len(real))
    return (
        f"{what}: {len(real)} counted, {len(ratios) - len(real)} rounding; "
        f"below a third of the true error {small} ({100 * small / n:.2g} %), "
        f"below it {int(np.sum(real < 1.0))}, above ten times {large} ({100 * large / n:.2g} %); "
        f"median {np.median(real) if len(real) else math.nan:.3g}"
    )


def main(cases: int = 200, first: int = 0) -> None:
    """Run and print."""
    positions: list[float] = []
    channels: list[float] = []
    for seed in range(first, first + cases):
        found = case(seed)
        if found is None:
            continue
        positions.append(found.positions)
        channels += found.channels.values()
        print(found.line, flush=True)
    print(counted(positions, "positions"))
    print(counted(channels, "channels"))


if __name__ == "__main__":
    main(*(int(x) for x in sys.argv[1:3]))
