"""Checks of the leg: own equations against both engines, the swing, its energy, the drop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.analytic import transition_matrices as tm
from mechlab.catalog.prosthetic_leg.build import FREE, LEG, build, tree
from mechlab.catalog.prosthetic_leg.dynamics import engine_terms, own_terms, random_states
from mechlab.catalog.prosthetic_leg.moving import MOVING
from mechlab.catalog.prosthetic_leg.parameters import Parameters
from mechlab.catalog.prosthetic_leg.scenes import SCENES, SWING_RATES, SWING_START, SWING_TIME, swing_motion
from mechlab.catalog.prosthetic_leg.sliders import answers
from mechlab.engines.protocol import WITNESSES, engine
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.scene import Settings
from mechlab.mechanism.geometry import Array

STATES = 50
DROP_TIMES = (0.08, 0.12, 0.2)


def _terms(p: Parameters, k: int, note: str) -> CheckResult:
    """Term k (M, h, qdd) at random states of the nine freedoms, each state relative to its largest entry."""
    m, t = build(p, "full"), tree(p, FREE["full"])
    q, v = random_states(STATES, len(FREE["full"]))
    own = own_terms(t, q, v)[k]
    axes = tuple(range(1, own.ndim))
    scale = np.max(np.abs(own), axis=axes, keepdims=True)
    said = {"analytic": own / scale}
    for name in WITNESSES:
        said[name] = np.array([engine_terms(name, m, a, b)[k] for a, b in zip(q, v, strict=True)]) / scale
    # Rounding of a 9 x 9 system: 1e-14 for M and h, times the condition of M (about 1e2) for the accelerations.
    return CheckResult(said, 1e-12, note=f"{note} at {STATES} random states, relative to the largest entry of each")


def _mass(p: Parameters) -> CheckResult:
    return _terms(p, 0, "mass matrix")


def _bias(p: Parameters) -> CheckResult:
    return _terms(p, 1, "velocity, weight, spring and damper terms")


def _accelerations(p: Parameters) -> CheckResult:
    return _terms(p, 2, "accelerations")


def _swing_start() -> tuple[Array, Array]:
    return np.array([SWING_START.get(n, 0.0) for n in LEG]), np.array([SWING_RATES.get(n, 0.0) for n in LEG])


def _swing(p: Parameters) -> CheckResult:
    scene = SCENES["swing"].make(p, "parts")
    own, _ = swing_motion(p, LEG, *_swing_start(), np.array([0.0, SWING_TIME]))
    said = {"analytic": own[-1]}
    for name in WITNESSES:
        settings = Settings(engine=name, integrator="RK4", timestep=1e-3)
        run = engine(name).run(build(p, "parts"), scene, settings)
        said[name] = np.array([run.channel(n)[-1] for n in LEG])
    # RK4 at 1 ms with modes of up to 48 Hz: 8.1e-9 measured, of order 4.
    return CheckResult(said, 1e-7, note="joints at the end of the swing")


def _energy(p: Parameters) -> CheckResult:
    free = replace(p, slider_damping=0.0, ankle_damping=0.0)
    q, v = swing_motion(free, LEG, *_swing_start(), np.linspace(0.0, SWING_TIME, 10))
    kinetic, potential = tm.energy(tree(free), q, v)
    total = kinetic + potential
    # DOP853 at 1e-10 relative: a few 1e-9 J of some 30 J.
    return CheckResult(
        {"analytic": total}, 1e-7, np.full(len(total), total[0]), "energy of the swing without dampers [J]"
    )


def _sliders(p: Parameters) -> CheckResult:
    said = {w: np.array(list(answers(p, w, SWING_TIME).values())) for w in ("pinocchio", "mujoco")}
    # Travel is read at samples; differences of two runs at 1 ms, 1e-8 each, and MuJoCo's clock of whole steps.
    return CheckResult(said, 1e-6, note="path errors of the ankle with joints locked, and travels [m]")


def _drop(p: Parameters) -> CheckResult:
    scene = replace(SCENES["stance-drop"].make(p, "full"), duration=DROP_TIMES[-1])
    said = {}
    for name in WITNESSES:
        run = engine(name).run(
            build(p, "full"), scene, Settings(engine=name, integrator="RK4", timestep=5e-4), list(DROP_TIMES)
        )
        said[name] = np.array([[run.at(n, t) for t in DROP_TIMES] for n in ("hitch", "thigh", "shin")])
    # The contact switches within a step: first order locally, h^2 x impact acceleration (1e2 m/s2) = 3e-5 m at most.
    return CheckResult(said, 3e-5, note="slides during the drop [m]")


CHECKS = (
    Check("L1", "mass matrix of nine freedoms", _mass, "matrix Lagrange equations"),
    Check("L2", "velocity, weight and elastic terms of nine freedoms", _bias, "matrix Lagrange equations"),
    Check("L3", "accelerations of nine freedoms", _accelerations, "matrix Lagrange equations"),
    Check("L4", "end of the swing", _swing, "matrix Lagrange equations, DOP853 to 1e-10"),
    Check("L5", "energy of the undamped swing", _energy, "conservation"),
    Check("L6", "which slides the swing needs", _sliders, "two engines"),
    Check("L7", "drop onto the straight leg", _drop, "two engines", slow=True),
    MOVING,
)
