"""A palletizing arm: two drives at the base, three parallelograms; the tool stays level without a drive of its own.

By hand: the wrist is at upper e^(i arm) - fore e^(i crank), and the tilt of the tool is 0 in every pose.
"""

import cmath
import math

import mechlab as ml


def palletizer(upper=0.5, fore=0.45, crank=0.15, lever=0.1):
    """Upper arm O-A; crank O-C moves the forearm through the rod C-B; two levelling rods hold triangle and tool."""
    b = ml.Builder("palletizer", gravity=(0, -9.81, 0))
    b.bar("arm", ml.revolute("arm_angle"), upper)
    b.bar("crank", ml.revolute("crank_angle"), crank, layer=0.03)
    b.bar("rod", ml.revolute("rod_joint"), upper, parent="crank", at=(crank, 0, 0), layer=0.06)
    b.plate("forearm", ml.revolute("elbow"), [(crank, 0), (-fore, 0), (0, 0.03)], parent="arm", at=(upper, 0, 0), layer=0.03, mass=1.0)
    b.plate("triangle", ml.revolute("triangle_joint"), [(-lever, 0), (0, lever)], parent="arm", at=(upper, 0, 0), layer=-0.03, mass=0.3)
    b.bar("level_rod", ml.revolute("level_joint"), upper, at=(-lever, 0, 0), layer=-0.06)
    b.bar("tool_rod", ml.revolute("tool_rod_joint"), fore, parent="triangle", at=(0, lever, 0), layer=-0.06)
    b.plate("tool", ml.revolute("wrist"), [(0, lever), (lever, 0)], parent="forearm", at=(-fore, 0, 0), layer=-0.03, mass=0.5)
    b.loop("B", "rod", "forearm", at_a=(upper, 0, 0), at_b=(crank, 0, 0))
    b.loop("H", "level_rod", "triangle", at_a=(upper, 0, 0), at_b=(-lever, 0, 0))
    b.loop("N", "tool_rod", "tool", at_a=(fore, 0, 0), at_b=(0, lever, 0))
    b.frame("wrist", "tool").frame("tip", "tool", at=(lever, 0, 0))
    for name in ("arm_angle", "crank_angle"):
        b.drive(name, stiffness=2000, damping=40)
    arm, crank_angle = 1.3, 2.9
    guess = {"arm_angle": arm, "crank_angle": crank_angle, "rod_joint": arm - crank_angle, "elbow": crank_angle - arm}
    guess |= {"triangle_joint": -arm, "level_joint": arm, "tool_rod_joint": crank_angle - math.pi, "wrist": -crank_angle}
    return b.assemble(guess, hold=["arm_angle", "crank_angle"])


if __name__ == "__main__":
    for arm, crank in ((1.3, 2.9), (1.0, 2.7), (0.9, 2.5)):
        found = ml.solve(palletizer(), arm_angle=arm, crank_angle=crank)["pinocchio"]
        wrist = complex(found["wrist_x"], found["wrist_y"])
        tip = complex(found["tip_x"], found["tip_y"])
        hand = cmath.rect(0.5, arm) - cmath.rect(0.45, crank)
        print(f"wrist {wrist:.9f}, by hand {hand:.9f} m; tilt of the tool {cmath.phase(tip - wrist):.1e} rad")
