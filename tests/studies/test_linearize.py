"""Linear equations with inputs: against equations by hand, both engines, and the motion of a session."""

import numpy as np
import pytest
import scipy.linalg

import mechlab as ml
from mechlab.errors import MechlabError, NoSolution
from mechlab.mechanism.parts import Winding

CART, BOB, LENGTH, DRAG = 1.2, 0.3, 0.5, 0.4


def cart(**drive):
    """A cart on x with a point mass on a pole of 0.5 m that stands at lean = 0, turning about y."""
    b = ml.Builder("cart", gravity=(0.0, 0.0, -9.81))
    tiny = (1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0)
    b.body("cart", ml.prismatic("x", "x", damping=DRAG), inertia=ml.Inertia(CART, tensor=tiny))
    b.body("pole", ml.revolute("lean", "y"), parent="cart", inertia=ml.Inertia(BOB, (0.0, 0.0, LENGTH), tiny))
    b.drive("x", **drive)
    return b.build()


def by_hand(stiffness=0.0, damping=DRAG):
    """(A, eigenvalues) of (M + m) x'' + m l a'' + c x' + k x = f, m l x'' + m l^2 a'' = m g l a."""
    mass = np.array([[CART + BOB, BOB * LENGTH], [BOB * LENGTH, BOB * LENGTH**2]])
    K, C = np.diag([stiffness, -BOB * 9.81 * LENGTH]), np.diag([damping, 0.0])
    lower = -np.linalg.solve(mass, np.hstack([K, C]))
    return np.vstack([np.hstack([np.zeros((2, 2)), np.eye(2)]), lower]), np.linalg.solve(mass, [1.0, 0.0])


@pytest.mark.parametrize("witness", ["pinocchio", "mujoco"])
@pytest.mark.parametrize("drive", ["motor", "speed", "servo", "winding"])
def test_a_cart_with_a_pole(drive, witness):
    """Eigenvalues, and the transfer from the command to cart and pole: the coordinates of the model are its own."""
    if drive == "motor":
        made, (A, b), gain = cart(), by_hand(), 1.0
    elif drive == "speed":
        made, (A, b), gain = cart(damping=5.0), by_hand(0.0, DRAG + 5.0), 5.0
    elif drive == "servo":
        made, (A, b), gain = cart(stiffness=40.0), by_hand(40.0), 40.0
    else:
        w = Winding(0.3, 2.0)
        made, (A, b), gain = cart(winding=w), by_hand(0.0, DRAG + 0.3**2 / 2.0), 0.15
    model = ml.linearize(made, witness=witness)
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(model.A)), np.sort_complex(np.linalg.eigvals(A)), atol=1e-6
    )
    assert model.at_rest == pytest.approx([0.0], abs=1e-9)
    s, outputs = 1.7 + 2.3j, np.hstack([model.basis, np.zeros((2, 2))])
    ours = outputs @ np.linalg.solve(s * np.eye(4) - model.A, model.B[:, 0])
    theirs = np.linalg.solve(s * np.eye(4) - A, np.concatenate([[0.0, 0.0], gain * b]))[:2]
    np.testing.assert_allclose(ours, theirs, rtol=1e-6)


def test_the_state_is_what_the_equations_move():
    """A small free motion of the closed four-bar held by its drive: x(t) = exp(A t) x(0), to second order in the amplitude."""
    m = ml.load("fourbar").mechanism()
    model = ml.linearize(m, crank_angle_0=1.2)
    with ml.session(m, start=lambda rng: {"crank_angle_0": 1.2 + 1e-4}, hold=0.002) as s:
        x = model.state(*s.state)
        assert np.abs(x[0]) > 1e-6 and x[1] == 0.0
        for _ in range(10):
            s.step(model.at_rest)
        expected = scipy.linalg.expm(model.A * s.time) @ x
        np.testing.assert_allclose(model.state(*s.state), expected, atol=2e-3 * np.abs(x).max() + 1e-7)


def test_a_regulator_of_the_closed_loop_balances_it():
    """LQR from A, B holds a pole that falls by itself; the rate of the slowest closed-loop pole is met."""
    model = ml.linearize(cart())
    Q, R = np.eye(4), np.array([[0.1]])
    gain = np.linalg.solve(R, model.B.T @ scipy.linalg.solve_continuous_are(model.A, model.B, Q, R))
    with ml.session(cart(), start=lambda rng: {"lean_0": 0.1}) as s:
        s.reset()
        sizes = []
        for _ in range(800):
            s.step(model.at_rest - gain @ model.state(*s.state))
            sizes.append(np.linalg.norm(model.state(*s.state)))
        assert s.health.trusted
    slowest = max(np.linalg.eigvals(model.A - model.B @ gain).real)
    seen = np.polyfit(0.01 * np.arange(400, 800), np.log(sizes[400:]), 1)[0]
    assert slowest < 0 and seen == pytest.approx(slowest, rel=0.1)
    assert np.linalg.eigvals(model.A).real.max() > 1.0  # it falls without


def test_what_cannot_be_linearized_is_told():
    with pytest.raises(NoSolution, match="cannot hold"):
        ml.linearize(cart(), lean_0=0.3)
    with pytest.raises(MechlabError, match="no drives"):
        ml.linearize("pendulum")
    with pytest.raises(MechlabError, match="lean"):
        ml.linearize(cart(), laen_0=0.3)
