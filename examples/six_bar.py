"""The shaper: crank, die block, slotted arm, link, ram. Six bars; the ram cuts slowly and returns quickly.

By hand, r the crank, d between the pivots, L the arm: at the ends of the stroke the arm is tangent to the circle of the crank, so
sin(a) = r / d, stroke = 2 L sin(a), and cutting takes (pi + 2 a) / (pi - 2 a) as long as the return.
"""

import math

import mechlab as ml


def shaper(crank=0.1, pivots=0.25, arm=0.5, link=0.15):
    """A crank at the origin, the pivot of the slotted arm below it, the ram at the height of the arm's end."""
    b = ml.Builder("shaper", gravity=(0, -9.81, 0))
    b.bar("crank", ml.revolute("crank_angle"), crank, layer=0.02)
    b.bar("arm", ml.revolute("arm_angle"), arm, at=(0, -pivots, 0))
    block = ml.shape("box", x=0.06, y=0.04, z=0.03)
    b.body("die", ml.prismatic("slide", "x"), parent="arm", inertia=ml.Inertia.box(0.2, 0.06, 0.04, 0.03), shapes=[block])
    b.bar("link", ml.revolute("link_joint"), link, parent="arm", at=(arm, 0, 0), layer=0.03)
    ram = ml.shape("box", x=0.3, y=0.05, z=0.05)
    b.body("ram", ml.prismatic("ram_x", "x"), at=(0, arm - pivots, 0), inertia=ml.Inertia(2.0), shapes=[ram])
    b.loop("crank_pin", "crank", "die", at_a=(crank, 0, 0))
    b.loop("ram_pin", "link", "ram", at_a=(link, 0, 0))
    b.drive("crank_angle", stiffness=50, damping=1)
    guess = {"crank_angle": 1.57, "arm_angle": 1.57, "slide": pivots + crank, "link_joint": -1.57, "ram_x": link}
    return b.assemble(guess, hold=["crank_angle"])


if __name__ == "__main__":
    a = math.asin(0.1 / 0.25)
    ends = [ml.solve(shaper(), crank_angle=angle) for angle in (-a, math.pi + a)]  # crank at right angles to the arm
    for engine in ("pinocchio", "mujoco"):
        right, left = (float(end[engine]["ram_x"]) for end in ends)
        print(f"{engine:10s} stroke {right - left:.9f} m")
    print(f"{'by hand':10s} stroke {2 * 0.5 * 0.1 / 0.25:.9f} m, times {(math.pi + 2 * a) / (math.pi - 2 * a):.4f} : 1")
