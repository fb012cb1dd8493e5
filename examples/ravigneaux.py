"""A Ravigneaux set, built from four meshes: two suns, a short and a long planet on one carrier, one ring; three gears.

By hand (Willis), with the small sun s, the large sun l and the ring r driven against the carrier c:
s - c = (z_r / z_s) (r - c) and l - c = -(z_r / z_l) (r - c).
"""

import math

import mechlab as ml

SMALL, LARGE, RING, SHORT, LONG = 30, 36, 78, 20, 21
MODULE = 2e-3  # [m]
HELD = {1: "carrier_angle", 2: "large_angle", -1: "carrier_angle"}
INPUT = {1: "small_angle", 2: "small_angle", -1: "large_angle"}


def ravigneaux(gear=1):
    """The set in first, second or reverse (-1) gear: a brake holds the carrier or the large sun, the ring is the output."""
    b = ml.Builder("ravigneaux_set")
    for name, teeth in (("small", SMALL), ("large", LARGE), ("ring", RING), ("carrier", LARGE)):
        b.body(name, ml.revolute(f"{name}_angle"), inertia=ml.Inertia.cylinder(0.5, MODULE * teeth / 2, 0.02))
    to_long, to_short, between = (MODULE * z / 2 for z in (LARGE + LONG, SMALL + SHORT, SHORT + LONG))
    turn = math.acos((to_long**2 + to_short**2 - between**2) / (2 * to_long * to_short))  # of the short planet from the long one
    places = {"long": (to_long, 0, 0), "short": (to_short * math.cos(turn), to_short * math.sin(turn), 0)}
    for name, at in places.items():
        b.body(name, ml.revolute(f"{name}_angle"), parent="carrier", at=at, inertia=ml.Inertia.cylinder(0.1, 0.02, 0.02))
    b.gears("small_short", "small_angle", "short_angle", teeth=(SMALL, SHORT), carrier="carrier")
    b.gears("short_long", "short_angle", "long_angle", teeth=(SHORT, LONG), carrier="carrier")
    b.gears("large_long", "large_angle", "long_angle", teeth=(LARGE, LONG), carrier="carrier")
    b.gears("ring_long", "ring_angle", "long_angle", teeth=(RING, LONG), carrier="carrier", kind="internal")
    b.relation("brake", **{HELD[gear]: 1})
    b.drive(INPUT[gear], stiffness=20, damping=0.2)
    return b.build()


if __name__ == "__main__":
    second = (1 + RING / SMALL * LARGE / RING) / (1 + LARGE / RING)  # l = 0 gives c = r / (1 + z_l / z_r)
    for gear, hand in ((1, RING / SMALL), (2, second), (-1, -RING / LARGE)):
        found = ml.solve(ravigneaux(gear), {f"{INPUT[gear]}_rate": 1.0})
        ratios = [1 / float(found[engine]["ring_angle_rate"]) for engine in ("pinocchio", "mujoco")]
        print(f"gear {gear:2d}: pinocchio {ratios[0]:.12f}, mujoco {ratios[1]:.12f}, by hand {hand:.12f}")
