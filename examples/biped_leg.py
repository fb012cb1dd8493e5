"""A standing leg, its knee moved from the ankle through a parallelogram, kept upright by a linear-quadratic regulator.

By hand: the motors hold the weight where it stands (ankle torque = weight x lever of the centre of mass), and what the regulator
spends on the way back from a small push, the integral of x' Q x + u' R u, is x(0)' P x(0), P from the Riccati equation.
"""

import numpy as np
import scipy.integrate
import scipy.linalg

import mechlab as ml

SHANK, THIGH, LEVER, BODY = 0.42, 0.40, 0.06, 20.0  # [m], [kg]
POSE = {"ankle": 1.45, "crank": 3.3}  # angles against the ground and the shank [rad]


def leg():
    """Shank on the ground, thigh with the weight of the body at the hip, crank at the ankle and rod along the shank."""
    b = ml.Builder("leg", gravity=(0, -9.81, 0))
    b.bar("shank", ml.revolute("ankle"), SHANK, mass=3.0)
    b.bar("thigh", ml.revolute("knee"), THIGH, parent="shank", at=(SHANK, 0, 0), mass=5.0, layer=0.03)
    b.body("hips", parent="thigh", at=(THIGH, 0, 0), inertia=ml.Inertia(BODY), shapes=[ml.shape("sphere", radius=0.06)])
    b.bar("crank", ml.revolute("crank"), LEVER, parent="shank", mass=0.1, layer=0.06)
    b.bar("rod", ml.revolute("rod_joint"), SHANK, parent="crank", at=(LEVER, 0, 0), mass=0.2, layer=0.09)
    b.loop("pin", "rod", "thigh", at_a=(SHANK, 0, 0), at_b=(-LEVER, 0, 0))
    for name in POSE:
        b.drive(name, limit=400)  # motors: their commands are torques [N m]
    return b.assemble({**POSE, "knee": POSE["crank"] - np.pi, "rod_joint": -POSE["crank"]}, hold=list(POSE))


def ankle_torque():
    """Torque [N m] about the ankle of all weights, with crank and knee held."""
    shank, lever = np.exp(1j * POSE["ankle"]), LEVER * np.exp(1j * (POSE["ankle"] + POSE["crank"]))
    thigh = -lever / LEVER
    places = {3.0: SHANK * shank / 2, 5.0: SHANK * shank + THIGH * thigh / 2, BODY: SHANK * shank + THIGH * thigh}
    places |= {0.1: lever / 2, 0.2: lever + SHANK * shank / 2}
    return 9.81 * sum(mass * at.real for mass, at in places.items())


def regulator(model):
    """Gain and cost matrix of the regulator with Q = 1 and R = 1."""
    Q, R = np.eye(len(model.A)), np.eye(model.B.shape[1])
    P = scipy.linalg.solve_continuous_are(model.A, model.B, Q, R)
    return np.linalg.solve(R, model.B.T @ P), P, Q, R


def push(mechanism, model, rate=0.05, duration=3.0):
    """Cost of the way back from a rate of the ankle [rad/s], first state, and the health of the run."""
    gain, _, Q, R = regulator(model)
    spent, first = [], None
    with ml.session(mechanism, hold=1e-3, start=lambda rng: {"ankle_rate_0": rate}) as s:
        s.reset()
        while s.time < duration - 1e-9:
            x = model.state(*s.state)
            u = -gain @ x
            spent.append((s.time, x @ Q @ x + u @ R @ u))
            s.step(model.at_rest + u)
            first = x if first is None else first
        return scipy.integrate.trapezoid(*np.transpose(spent)[::-1]), first, s.recording().health


if __name__ == "__main__":
    model = ml.linearize(leg())
    print(f"run     ankle torque at rest {model.at_rest[0]:.6f} N m")
    print(f"by hand ankle torque at rest {ankle_torque():.6f} N m")
    cost, x, health = push(leg(), model)
    print(f"run     cost {cost:.6e}, trusted: {health.trusted}")
    print(f"by hand cost {x @ regulator(model)[1] @ x:.6e}")
