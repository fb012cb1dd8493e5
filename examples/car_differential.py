"""The differential of a car: pinion, crown wheel with cage, two bevel planets, two axle gears.

By hand: cage = pinion teeth / crown teeth, cage = (left + right) / 2, and both axles get the same torque, half of that at the cage.
"""

import mechlab as ml


def differential(pinion=10, crown=41, planet=10, side=16, wheel_inertia=1.2):
    """The axles lie along x, the pinion along y; the planets turn about the radial axis z of the cage."""
    b = ml.Builder("differential")
    b.body("pinion", ml.revolute("pinion_angle", "y"), inertia=ml.Inertia.cylinder(1.0, 0.03, 0.05, axis=(0, 1, 0)))
    b.body("cage", ml.revolute("cage_angle", "x"), inertia=ml.Inertia.cylinder(6.0, 0.1, 0.1, axis=(1, 0, 0)))
    for name in ("left", "right"):
        b.body(name, ml.revolute(f"{name}_angle", "x"), inertia=ml.Inertia.axial(20.0, wheel_inertia, 1.0, axis=(1, 0, 0)))
    b.body("planet", ml.revolute("planet_angle", "z"), parent="cage", inertia=ml.Inertia.cylinder(0.3, 0.02, 0.02))
    b.gears("crown", "pinion_angle", "cage_angle", teeth=(pinion, crown), kind="bevel", side=-1)
    b.gears("mesh_left", "left_angle", "planet_angle", teeth=(side, planet), carrier="cage", kind="bevel")
    b.gears("mesh_right", "right_angle", "planet_angle", teeth=(side, planet), carrier="cage", kind="bevel", side=-1)
    return b.build()


if __name__ == "__main__":
    curve = ml.solve(differential(), pinion_angle_rate=41.0, left_angle_rate=8.0)
    for engine in ("pinocchio", "mujoco"):
        print(f"{engine:10s} right wheel {abs(curve[engine]['right_angle_rate']):.12f} rad/s")
    print(f"{'by hand':10s} right wheel {2 * 41.0 * 10 / 41 - 8:.12f} rad/s")
    run = ml.simulate(differential(), laws=[ml.Constant("pinion_angle", 50.0)], duration=1.0, max_error=1e-3)
    cage = 0.5 * 6.0 * 0.1**2 + 0.3 * (3 * 0.02**2 + 0.02**2) / 12 + 2 * 1.2 + 0.5 * 1.0 * 0.03**2 * 4.1**2
    print(f"{'run':10s} left {run.at('left_angle_rate', 1.0):.6f}, right {run.at('right_angle_rate', 1.0):.6f} rad/s after 1 s")
    print(f"{'by hand':10s} both {50.0 * 4.1 / cage:.6f} rad/s, trusted: {run.health.trusted}")
