"""Peaucellier's linkage: eight bars (the ground is one) that lead a point exactly along a straight line.

By hand: O, A and P stay in line with |OA| |OP| = arm^2 - side^2, and A goes on a circle through O of diameter 2 crank. The inverse of
such a circle is the line x = (arm^2 - side^2) / (2 crank).
"""

import math

import mechlab as ml


def inversor(arm=0.25, side=0.1, crank=0.08):
    """Arms O-B and O-C, rhombus A-B-P-C, crank Q-A; O at the origin, Q on the x axis."""
    b = ml.Builder("inversor")
    b.bar("crank", ml.revolute("crank_angle"), crank, at=(crank, 0, 0), layer=0.03)
    for name in ("up", "down"):
        b.bar(f"arm_{name}", ml.revolute(f"{name}_angle"), arm)
        b.bar(f"inner_{name}", ml.revolute(f"inner_{name}_joint"), side, parent=f"arm_{name}", at=(arm, 0, 0), layer=0.02)
        b.bar(f"outer_{name}", ml.revolute(f"outer_{name}_joint"), side, parent=f"arm_{name}", at=(arm, 0, 0), layer=0.04)
        b.loop(f"A_{name}", "crank", f"inner_{name}", at_a=(crank, 0, 0), at_b=(side, 0, 0))
    b.loop("P", "outer_up", "outer_down", at_a=(side, 0, 0), at_b=(side, 0, 0))
    b.frame("P", "outer_up", at=(side, 0, 0))
    b.drive("crank_angle", stiffness=5, damping=0.1)
    open_by = math.acos((arm**2 + (2 * crank) ** 2 - side**2) / (4 * arm * crank))  # triangle O-B-A with A at 2 crank
    inner = math.atan2(-arm * math.sin(open_by), 2 * crank - arm * math.cos(open_by))
    guess = {"up_angle": open_by, "inner_up_joint": inner - open_by, "outer_up_joint": -math.pi - inner - open_by}
    guess |= {name.replace("up", "down"): -value for name, value in guess.items()}
    return b.assemble(guess, hold=["crank_angle"])


if __name__ == "__main__":
    line = (0.25**2 - 0.1**2) / (2 * 0.08)
    for angle in (-0.4, 0.0, 0.4):
        found = ml.solve(inversor(), crank_angle=angle)
        x, y = (float(found["pinocchio"][f"P_{k}"]) for k in "xy")
        print(f"crank {angle:4.1f} rad: P at x = {x:.12f}, y = {y:8.5f} m;  by hand x = {line:.12f} m")
