"""Checks of the methods behind the class IV linkage on a four-bar whose answers are known to the last digit."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic import assur
from mechlab.analytic.benchmarks.planar import FourbarCrank
from mechlab.analytic.fourbar import solve as fourbar_motion
from mechlab.engines.protocol import WITNESSES, engine
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism import Builder, ConstraintSet, Inertia, Mechanism, TreeKinematics, revolute
from mechlab.mechanism.geometry import Array

LENGTHS = (0.1, 0.3, 0.25, 0.3)
SPEED = 2.0 * math.pi
THIN = 1e-5
"""Radius of the bars [m]: slender to 1e-9 in every moment."""


@lru_cache(maxsize=8)
def fourbar(start: float, tilt: float = 0.0) -> Mechanism:
    """The laboratory's four-bar, rods of 1 kg/m without gravity, reference at crank angle `start`; `tilt` [rad] of one axis."""
    crank, coupler, rocker, ground = LENGTHS
    b = Builder("fourbar", gravity=(0.0, 0.0, 0.0))
    axis = (0.0, math.sin(tilt), math.cos(tilt))
    for name, length, parent, at, along in (
        ("crank", crank, "ground", 0.0, "z"), ("coupler", coupler, "crank", crank, axis), ("rocker", rocker, "ground", ground, "z"),
    ):  # fmt: skip
        inertia = Inertia.rod(length, (0.0, 0.0, 0.0), (length, 0.0, 0.0), THIN)
        b.body(name, revolute(name, along), parent=parent, at=(at, 0.0, 0.0), inertia=inertia)
    b.loop("pin", "coupler", "rocker", (coupler, 0.0, 0.0), (rocker, 0.0, 0.0)).drive("crank")
    return b.assemble({"crank": start, "coupler": -0.4, "rocker": 1.5}, hold=["crank"])


def _rates(m: Mechanism) -> Array:
    """Rates of all joints at the reference pose when the crank turns at SPEED."""
    jacobian = np.vstack([ConstraintSet(m).jacobian(TreeKinematics(m)), m.row("crank")])
    return np.asarray(np.linalg.lstsq(jacobian, np.array([0.0, 0.0, 0.0, SPEED]), rcond=1e-11)[0])


def _acceleration(p: Any) -> CheckResult:
    m = fourbar(0.9)
    v = _rates(m)
    closed = FourbarCrank(*LENGTHS, 1, 1.0, 0.0).acceleration(0.9, SPEED, 0.0)
    k = m.v_slice["crank"].start
    measured = {"analytic": closed} | {e: engine(e).accelerations(m, m.reference(), v)[k] for e in WITNESSES}
    # The reference is printed to 1e-6 rad/s2; MuJoCo's rigid rows are solved to 1e-10 of the accelerations.
    return CheckResult(measured, 1e-6, -33.175986, "free crank at 0.9 rad and 2 pi rad/s [rad/s2]")


def _energy_speed(p: Any) -> CheckResult:
    from scipy.integrate import solve_ivp

    m = fourbar(0.3)
    scene = Scene("free-run", "minimal", 5.0, initial_rates={"crank": SPEED})
    run = engine("mujoco").run(m, scene, Settings(timestep=1e-3))
    bar = FourbarCrank(*LENGTHS, 1, 1.0, 0.0)

    def slope(t: float, y: Array) -> list[float]:
        return [float(y[1]), bar.acceleration(float(y[0]), float(y[1]), 0.0)]

    exact = solve_ivp(slope, (0.0, 5.0), [0.3, SPEED], method="DOP853", rtol=1e-11, atol=1e-11).y[1, -1]
    gap = run.health.finding("loop_gap").value
    measured = {"mujoco": [gap / 1e-7, (run.channel("crank_rate")[-1] - exact) / (5e-5 * SPEED)]}
    # In units of the limits: gap 1e-7 m; speed 5e-5 of 2 pi after five turns (second-order softness of the loop at 1 ms).
    return CheckResult(
        measured, 1.0, [0.0, 0.0], "free run of 5 s at 1 ms: loop gap and crank speed, in units of their limits"
    )


def _axes(p: Any) -> CheckResult:
    shared = len({j.axis for j in fourbar(1.0).joints})
    refused = 0
    for tilt in (3.67e-6, 1e-4, 1e-3, 1e-2):
        try:
            fourbar(1.0, tilt)
        except MechlabError:
            refused += 1
    return CheckResult(
        {"builder": [shared, refused]}, 0.0, [1, 4], "distinct axes of the planar loop; tilted ones refused, of 4"
    )


def _parallelogram(p: Any) -> CheckResult:
    """The crank turned from 10 to 270 deg in five step sizes; rocker as long as it, 0.1 mm longer, 0.1 mm shorter."""
    measured: list[list[float]] = []
    for step in (1.0, 2.5, 5.0, 7.0, 10.0):
        phi = np.radians(np.arange(10.0, 270.1, step))
        measured.append([_followed(0.1, phi), _followed(0.1001, phi), _followed(0.0999, phi)])
    note = "0: stays in its mode and moves as the four-bar's closed form, 1: change point told, 2: no assembly told"
    return CheckResult({"analytic": measured}, 0.0, [[1.0, 0.0, 2.0]] * 5, note)


def _followed(rocker: float, phi: Array) -> float:
    def group(angle: Array) -> Any:
        return assur.rrr(assur.driver(assur.fixed(), 0.1, angle, 1.0), assur.fixed(0.3, 0.0), 0.3, rocker)

    try:
        found = assur.follow_dyad(group, phi)
    except assur.ChangePoint:
        return 1.0
    except NoSolution:
        return 2.0
    return 0.0 if _as_fourbar(found, rocker, phi) else -1.0


def _as_fourbar(found: assur.Dyad, rocker: float, phi: Array) -> bool:
    """Whether joint, quality, discriminant and link angles of the dyad agree with the closed form of the four-bar."""
    own = fourbar_motion(0.1, 0.3, rocker, 0.3, phi, 1.0)
    pin = rocker * np.exp(1j * own.rocker_angle)
    joint = (0.3 + pin, 1j * own.rocker_rate * pin, (1j * own.rocker_accel - own.rocker_rate**2) * pin)
    sine = np.sin(own.transmission_angle)
    pairs: list[tuple[Any, Any]] = list(zip((found.joint.p, found.joint.v, found.joint.a), joint, strict=True))
    pairs += [(found.quality, sine), (found.discriminant, sine**2)]
    for link, bar in zip(found.angles, ("coupler", "rocker"), strict=True):
        expected = (getattr(own, f"{bar}_{k}") for k in ("angle", "rate", "accel"))
        pairs += zip((link.x, link.v, link.a), expected, strict=True)
    # Near its change point, at quality 0.02, rounding grows 1e4-fold.
    return all(np.allclose(a, b, rtol=0.0, atol=1e-9 * max(1.0, float(np.max(np.abs(b))))) for a, b in pairs)


FOURBAR_CHECKS = (
    Check("C6b", "four-bar, free run in MuJoCo against the energy law", _energy_speed, "Eksergian equation, DOP853"),
    Check("C7", "acceleration at a consistent state includes the turning of the loop", _acceleration, "energy law of the four-bar"),
    Check("C8", "axes of a planar loop are one vector; a tilt is refused", _axes, "bit for bit"),
    Check("C9", "parallelogram: nothing flips silently", _parallelogram, "change point at 180 deg"),
)  # fmt: skip
