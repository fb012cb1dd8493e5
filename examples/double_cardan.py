"""Two cardan joints, bent alike: the middle shaft turns unevenly, the follower exactly as the driver.

By hand: tan(driver) = tan(middle) cos(bend), counted from the pose where the pin of the driver lies in the plane of the shafts, so
the middle shaft turns between cos(bend) and 1 / cos(bend) times as fast.
"""

import math

import mechlab as ml


def drive_line(bend=0.5, length=0.2):
    """Three shafts in the plane x-y; the yokes of the middle one lie in one plane. Both crosses are loops with two pins."""
    b = ml.Builder("drive_line")
    c, s = math.cos(bend), math.sin(bend)
    rod = {"inertia": ml.Inertia.cylinder(0.5, 0.01, length, axis=(1, 0, 0))}
    b.body("driver", ml.revolute("driver_angle", (c, s, 0)), at=(-length / 2, 0, 0), **rod)
    b.body("middle", ml.revolute("middle_angle", (1, 0, 0)), **rod)
    b.body("follower", ml.revolute("follower_angle", (c, -s, 0)), at=(length / 2, 0, 0), **rod)
    left, right = (-length / 2, 0, 0), (length / 2, 0, 0)
    b.loop("cross_1", "driver", "middle", at_b=left, kind="universal", axis_a=(-s, c, 0), axis_b="z")
    b.loop("cross_2", "middle", "follower", at_a=right, kind="universal", axis_a="z", axis_b=(s, c, 0))
    b.drive("driver_angle", stiffness=5, damping=0.1)
    return b.build()


if __name__ == "__main__":
    bend = 0.5
    for angle in (0.0, 0.6, math.pi / 2):
        found = ml.solve(drive_line(), driver_angle=angle, driver_angle_rate=1.0)
        rate = math.cos(bend) / (math.sin(angle) ** 2 + (math.cos(angle) * math.cos(bend)) ** 2)
        for engine in ("pinocchio", "mujoco"):
            got = found[engine]
            print(f"driver {angle:.2f} rad, {engine:9s}: middle {got['middle_angle_rate']:.9f}, follower {got['follower_angle_rate']:.9f}")
        print(f"driver {angle:.2f} rad, by hand  : middle {rate:.9f}, follower {1:.9f} rad/s")
