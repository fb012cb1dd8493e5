"""A slider-crank pump: a motor and a flywheel against the dry friction of the piston.

By hand: in steady motion the friction takes 4 crank F in each turn, the motor gives 2 pi T, so T = 2 crank F / pi, and the line of
the motor gives the speed, no_load (1 - T / stall). The flywheel makes the speed even enough for that.
"""

import math

import mechlab as ml


def pump(crank=0.05, rod=0.2, friction=100.0, flywheel=2.0):
    """Crank with a flywheel [kg m2], rod, piston with dry friction [N]; gravity does not act along the cylinder."""
    b = ml.Builder("pump", gravity=(0, 0, -9.81))
    wheel = ml.shape("cylinder", radius=0.15, length=0.02)
    b.body("crank", ml.revolute("crank_angle"), inertia=ml.Inertia.axial(20.0, flywheel, flywheel / 2), shapes=[wheel])
    b.bar("rod", ml.revolute("rod_joint"), rod, parent="crank", at=(crank, 0, 0), mass=0.05, layer=0.03)
    piston = ml.shape("cylinder", radius=0.03, length=0.06)
    b.body("piston", ml.prismatic("piston_x", "x", friction=friction), inertia=ml.Inertia(0.1), shapes=[piston])
    b.loop("pin", "rod", "piston", at_a=(rod, 0, 0))
    return b.assemble({"piston_x": crank + rod})


if __name__ == "__main__":
    torque, no_load = 2 * 0.05 * 100.0 / math.pi, 30.0
    hand = no_load * (1 - torque / 10.0)
    motor = ml.Motor("crank_angle", stall=10.0, no_load_rate=no_load)
    run = ml.simulate(pump(), laws=[motor], crank_angle_0=1.0, crank_angle_rate_0=hand, duration=2.0, timestep=2e-5)
    turns = (run.at("crank_angle", 2.0) - 1.0) / 2.0
    print(f"run     mean speed over 2 s {turns:.3f} rad/s, trusted: {run.health.trusted}")
    print(f"by hand mean speed          {hand:.3f} rad/s at {torque:.3f} N m")
