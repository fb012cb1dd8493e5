"""Pin forces of the four-bar: the crank torque against the one-freedom equation, balance of every link, both engines."""

import numpy as np
import pytest

from mechlab.analytic import fourbar
from mechlab.catalog import fourbar as catalog
from mechlab.engines.mujoco.reactions import InverseDynamicsSolver
from mechlab.engines.own.closed_path import ClosedPath
from mechlab.engines.pinocchio.reactions import inverse_dynamics
from mechlab.errors import NoSolution

LINKS = (
    fourbar.LinkMass(0.4, 0.03, 2e-4),
    fourbar.LinkMass(0.7, 0.2, 6e-3, 0.05),
    fourbar.LinkMass(0.5, 0.12, 3e-3, -0.02),
)
BAR = fourbar.MovingFourbar(0.1, 0.35, 0.3, 0.4, *LINKS)
GRAVITY = (0.4, -9.81)
PHI = np.linspace(0.0, 2 * np.pi, 37)


@pytest.mark.parametrize("mode", [1, -1])
def test_the_crank_torque_is_that_of_the_one_freedom_equation(mode):
    bar = fourbar.MovingFourbar(0.1, 0.35, 0.3, 0.4, *LINKS, mode)
    w, eps = 5.0 + np.sin(PHI), -3.0 * np.cos(PHI)
    torque = fourbar.pin_forces(bar, PHI, w, eps, GRAVITY).crank_torque
    # Another path: J(phi) and its slope, without any pin force. Rounding of forces of some ten newtons.
    assert np.allclose(fourbar.acceleration(bar, PHI, w, torque, GRAVITY), eps, rtol=0, atol=1e-9)


def test_a_load_on_the_rocker_is_passed_on_by_virtual_work():
    still = fourbar.pin_forces(BAR, PHI, 0.0, rocker_torque=2.0)
    ratio = fourbar.solve(0.1, 0.35, 0.3, 0.4, PHI, 1.0).rocker_rate
    assert np.allclose(still.crank_torque, -2.0 * ratio, atol=1e-13)
    coupler = fourbar.solve(0.1, 0.35, 0.3, 0.4, PHI).coupler_angle
    along = np.stack([np.cos(coupler), np.sin(coupler)], axis=-1)
    assert (
        np.abs(still.force_c[:, 0] * along[:, 1] - still.force_c[:, 1] * along[:, 0]).max() < 1e-13
    )  # a two-force member


def test_the_ground_feels_weight_and_shaking_force():
    found = fourbar.pin_forces(BAR, PHI, 6.0, 2.0, GRAVITY)
    weight = sum(x.mass for x in LINKS) * np.array(GRAVITY)
    assert np.allclose(-found.force_a - found.force_d, found.shaking_force + weight, atol=1e-12)
    # The shaking force is the rate of the momentum: second difference of the sum of m r.
    h = 1e-4
    t = np.array([-h, 0.0, h])
    phi = 1.0 + 6.0 * t + 1.0 * t**2
    gravity_of = [fourbar.potential_energy(BAR, phi, g) for g in ((-1.0, 0.0), (0.0, -1.0))]
    slope = np.array([(e[0] - 2 * e[1] + e[2]) / h**2 for e in gravity_of])
    assert np.allclose(fourbar.pin_forces(BAR, 1.0, 6.0, 2.0).shaking_force, -slope, atol=1e-5)


def test_pin_forces_of_both_engines():
    p = catalog.Parameters()
    m = catalog.build(p, "minimal")
    # The bars of the catalog are round rods: their own moments of inertia about the normal.
    links = [fourbar.LinkMass(b.inertia.mass, b.inertia.com[0], b.inertia.matrix()[1, 1]) for b in m.bodies]
    bar = fourbar.MovingFourbar(*p.lengths, *links, mode=p.mode)
    path, engine = ClosedPath(m, "crank_angle"), InverseDynamicsSolver(m)
    for phi in np.linspace(0.1, 6.2, 8):
        pose = path.at(phi)
        v, load = 6.0 * pose.u, 2.5 * m.row("rocker_angle")
        own = fourbar.pin_forces(bar, phi, 6.0, -2.0, (0.0, -p.gravity), 2.5)
        pin = inverse_dynamics(m, pose.q, v, {"crank_angle": -2.0}, ["crank_angle"], load)
        other = engine.solve(pose.q, v, "crank_angle", -2.0, load)
        pairs = [(own.force_c, pin.loops["pin"].force, other.loops["pin"])]
        for joint, force in (
            ("crank_angle", own.force_a),
            ("coupler_joint", own.force_b),
            ("rocker_angle", own.force_d),
        ):
            pairs.append((force, pin.joints[joint].force, other.joints[joint][:3]))
        for mine, theirs, third in pairs:
            # Rounding of forces of some ten newtons; the engines solve least squares: 1e-13 measured.
            assert np.abs(mine - theirs[[0, 2]]).max() < 1e-11
            assert np.abs(theirs - third).max() < 1e-11
        assert float(own.crank_torque) == pytest.approx(pin.drive_forces["crank_angle"], abs=1e-12)
        assert other.drive_force == pytest.approx(pin.drive_forces["crank_angle"], abs=1e-11)


def test_no_forces_where_coupler_and_rocker_are_in_line():
    with pytest.raises(NoSolution):
        fourbar.pin_forces(fourbar.MovingFourbar(0.4, 0.2, 0.25, 0.3, *LINKS), np.pi, 1.0)
