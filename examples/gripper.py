"""A toggle gripper closes on a workpiece: contact as a one-sided stop, the grip as the hand formula has it.

By hand: virtual work of the drive force F on the slider and the grip N on both jaws, with links between slider (y) and jaws (x),
x dx = -y dy, so N = F x / (2 y). The jaw stands where N also is the stiffness of the contact times its depth.
"""

import math

import mechlab as ml

LINK, OPEN, WORKPIECE = 0.10, 0.06, 0.05  # [m]: links, jaw from the middle at the start, half of the workpiece
FORCE, STIFFNESS = 40.0, 2e5  # [N], [N/m]


def gripper():
    """A slider along y pulls two links; the jaws slide along x on both sides, closing as the slider rises."""
    b = ml.Builder("gripper")
    start = math.sqrt(LINK**2 - OPEN**2)
    b.body("slider", ml.prismatic("y", "y", zero=start, damping=40.0), at=(0, start, 0), inertia=ml.Inertia(0.3),
           shapes=[ml.shape("box", x=0.03, y=0.02, z=0.02)])  # fmt: skip
    for name, side in (("right", 1), ("left", -1)):
        jaw = ml.shape("box", x=0.01, y=0.04, z=0.02)
        b.body(name, ml.prismatic(f"{name}_x", (side, 0, 0), zero=OPEN, damping=10.0), at=(side * OPEN, 0, 0), inertia=ml.Inertia(0.2),
               shapes=[jaw])  # fmt: skip
        b.bar(f"link_{name}", ml.revolute(f"{name}_angle", "z"), LINK, parent=name, mass=0.05)
        b.loop(f"pin_{name}", f"link_{name}", "slider", at_a=(LINK, 0, 0))
    return b.assemble({"right_angle": math.atan2(start, -OPEN), "left_angle": math.atan2(start, OPEN)}, hold=["y"])


def closing():
    """What acts: the drive, and the workpiece that pushes against both jaws once they touch it."""
    touch = [ml.OneSidedStop(f"{name}_x", at=WORKPIECE, side=-1, stiffness=STIFFNESS, damping=200.0) for name in ("right", "left")]
    return [ml.Constant("y", FORCE), *touch]


if __name__ == "__main__":
    run = ml.simulate(gripper(), laws=closing(), duration=1.5, max_error=1e-6)
    x, y = run.at("right_x", 1.5), run.at("y", 1.5)
    print(f"run     jaw at {x:.6f} m, grip {STIFFNESS * (WORKPIECE - x):.3f} N, trusted: {run.health.trusted}")
    print(f"by hand grip {FORCE * x / (2 * y):.3f} N")
