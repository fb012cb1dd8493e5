"""Mechanisms to simulate, and an independent truth for their motion: dense constrained equations, DOP853."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechlab.mechanism import (
    Builder,
    ConstraintSet,
    Inertia,
    Loop,
    Mechanism,
    Placement,
    TreeKinematics,
    integrate,
    prismatic,
    revolute,
)

GRAVITY = (0.0, -9.81, 0.0)


def fourbar(kind: str = "spherical", **options: object) -> Mechanism:
    """A planar four-bar whose coupler and rocker are joined by a loop of the given kind, its axis along z."""
    b = Builder("fourbar", gravity=GRAVITY)
    b.bar("crank", revolute("crank_angle", **options), 0.1)
    b.bar("coupler", revolute("coupler_angle"), 0.3, parent="crank", at=(0.1, 0, 0))
    b.bar("rocker", revolute("rocker_angle"), 0.25, at=(0.3, 0, 0))
    if kind == "universal":  # one pin along z, the other across
        upright = Placement.of(np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]), (0.3, 0, 0))
        across = Placement((0.25, 0.0, 0.0))
        b.close_here(Loop("pin", kind, "coupler", "rocker", upright, across))
    else:
        b.loop("pin", "coupler", "rocker", (0.3, 0, 0), (0.25, 0, 0), kind=kind)
    b.drive("crank_angle", stiffness=50.0, damping=1.0)
    b.frame("pin_point", "coupler", (0.3, 0, 0))
    guess = {"crank_angle": 0.9, "coupler_angle": -0.3, "rocker_angle": 1.5}
    return b.assemble(guess, hold=["crank_angle"])


def slider_crank(kind: str, ground_first: bool = True) -> Mechanism:
    """Crank, rod and block in a chain; the block is held on the x axis by a loop (prismatic, cylindrical or fixed to a
    slide), so that the closing joint carries force and moment."""
    b = Builder("slider_crank", gravity=GRAVITY)
    b.bar("crank", revolute("crank_angle"), 0.1)
    b.bar("rod", revolute("rod_angle"), 0.3, parent="crank", at=(0.1, 0, 0))
    # centre of mass off the pin: the guide must carry a moment
    block = Inertia.box(0.5, 0.05, 0.03, 0.03, (0.02, 0.01, 0.0))
    b.body("block", revolute("block_angle"), parent="rod", at=(0.3, 0, 0), inertia=block)
    if kind == "fixed":
        b.body("slide", prismatic("slide", "x"), inertia=Inertia.point(0.1) + Inertia.box(0.1, 0.02, 0.02, 0.02))
        ends = [("slide", "z"), ("block", "z")]
    else:
        ends = [("ground", "x"), ("block", "x")]
    (one, axis_a), (two, axis_b) = ends if ground_first else ends[::-1]
    b.loop("guide", one, two, kind=kind, axis_a=axis_a, axis_b=axis_b)
    guess = {"crank_angle": 0.9, "rod_angle": -1.2, "block_angle": 0.3, **({"slide": 0.3} if kind == "fixed" else {})}
    return b.assemble(guess, hold=["crank_angle"])


def planetary() -> Mechanism:
    """Sun, carrier, ring and three planets on the carrier, six meshes of rank four."""
    b = Builder("stage", gravity=(0.0, 0.0, 0.0))
    b.body("sun", revolute("sun"), inertia=Inertia.cylinder(1.0, 0.03, 0.02))
    b.body("carrier", revolute("carrier"), inertia=Inertia.cylinder(1.0, 0.05, 0.01))
    b.body("ring", revolute("ring"), inertia=Inertia.cylinder(1.0, 0.09, 0.01))
    for i in range(3):
        a = 2 * np.pi * i / 3
        at = (0.054 * np.cos(a), 0.054 * np.sin(a), 0.0)
        planet = Inertia.cylinder(0.3, 0.02, 0.02)
        b.body(f"planet_{i}", revolute(f"planet_{i}"), parent="carrier", at=at, inertia=planet)
        b.gears(f"sun_planet_{i}", "sun", f"planet_{i}", (24, 30), "carrier")
        b.gears(f"ring_planet_{i}", "ring", f"planet_{i}", (84, 30), "carrier", kind="internal")
    return b.build()


def dense(m: Mechanism, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations and multipliers of M a + h = tau + J^T r, J a + b = 0; redundant rows by least squares."""
    tree, c = TreeKinematics(m, q, v), ConstraintSet(m)
    jacobian, bias = c.jacobian(tree), c.bias(tree)
    mass, n = tree.mass_matrix(), len(c)
    kkt = np.block([[mass, -jacobian.T], [jacobian, np.zeros((n, n))]])
    solution = np.linalg.lstsq(kkt, np.concatenate([tau - tree.bias_force(), -bias]), rcond=1e-12)[0]
    return solution[: m.nv], solution[m.nv :]


def motion(m: Mechanism, q0: np.ndarray, v0: np.ndarray, t: float, tau: Callable | None = None) -> tuple:
    """q and v at time t by DOP853 (rtol 1e-10) on the dense equations, stabilized; joints without quaternions only."""
    c = ConstraintSet(m)

    def rhs(time: float, state: np.ndarray) -> np.ndarray:
        q, v = state[: m.nq], state[m.nq :]
        a, _ = dense(m, q, v, np.zeros(m.nv) if tau is None else tau(time, q, v))
        return np.concatenate([v, a])

    out = solve_ivp(rhs, (0.0, t), np.concatenate([q0, v0]), method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
    assert np.abs(c.residual(TreeKinematics(m, out[: m.nq]))).max() < 1e-8  # the reference itself did not drift
    return out[: m.nq], out[m.nq :]


@pytest.fixture(scope="session")
def lab() -> SimpleNamespace:
    """The builders and the independent solver of this file."""
    return SimpleNamespace(
        fourbar=fourbar, slider_crank=slider_crank, planetary=planetary, dense=dense, motion=motion, integrate=integrate
    )
