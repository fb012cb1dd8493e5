"""A Stewart platform: six legs of changing length carry a plate with six freedoms.

By hand: the length of leg i is |p + R b_i - a_i|, with the pins a_i of the base, b_i of the plate, R = Rx(roll) Ry(pitch) Rz(yaw).
"""

import math

import numpy as np

import mechlab as ml


def pins(radius, half_angle):
    """(6, 3) points in three pairs on a circle [m]."""
    angles = [2 * math.pi * k / 3 + s * half_angle for k in range(3) for s in (-1, 1)]
    return np.array([[radius * math.cos(a), radius * math.sin(a), 0.0] for a in angles])


def platform(base=0.4, top=0.25, height=0.5):
    """The plate on six joints along and about x, y, z; each leg a universal joint, a slide, a ball."""
    b = ml.Builder("stewart_platform", gravity=(0, 0, -9.81))
    joints = [ml.prismatic(k, k) for k in "xy"] + [ml.prismatic("z", "z", zero=height)]
    joints += [ml.revolute(n, axis) for n, axis in (("roll", "x"), ("pitch", "y"), ("yaw", "z"))]
    plate = [ml.shape("cylinder", radius=top, length=0.02)]
    b.body("plate", *joints, at=(0, 0, height), inertia=ml.Inertia.cylinder(5.0, top, 0.02), shapes=plate)
    for k, (low, high) in enumerate(zip(pins(base, 0.2), np.roll(pins(top, math.pi / 3 - 0.2), -1, axis=0), strict=True)):
        leg = high + (0, 0, height) - low
        length = float(np.linalg.norm(leg))
        barrel, rod = ml.Inertia.rod(0.5, (0, 0, 0), (0, 0, 0.3), 0.015), ml.Inertia.rod(0.3, (0, 0, 0.3), (0, 0, length), 0.01)
        across = np.cross((0, 0, 1), leg / length)
        turned = ml.Placement.of(np.column_stack((across, np.cross(leg / length, across), leg / length)), (0, 0, 0))
        b.body(f"barrel_{k}", *ml.universal(f"tilt_{k}", f"swing_{k}"), at=low, turned=turned, inertia=barrel)
        b.body(f"rod_{k}", ml.prismatic(f"leg_{k}", "z", zero=length), parent=f"barrel_{k}", inertia=rod)
        b.loop(f"ball_{k}", f"rod_{k}", "plate", at_a=(0, 0, length), at_b=high)
        b.drive(f"leg_{k}", stiffness=2e4, damping=500)
    return b.build()


def lengths(x, y, z, roll, pitch, yaw, base=0.4, top=0.25):
    """(6,) lengths of the legs [m], by hand."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x, about_y = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]]), np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    high = np.roll(pins(top, math.pi / 3 - 0.2), -1, axis=0) @ (about_x @ about_y @ about_z).T
    return np.linalg.norm(high + (x, y, z) - pins(base, 0.2), axis=1)


if __name__ == "__main__":
    pose = {"x": 0.05, "y": -0.03, "z": 0.55, "roll": 0.1, "pitch": -0.15, "yaw": 0.2}
    found = ml.solve(platform(), pose)
    for engine in ("pinocchio", "mujoco"):
        print(f"{engine:10s}", " ".join(f"{float(found[engine][f'leg_{k}']):.9f}" for k in range(6)))
    print(f"{'by hand':10s}", " ".join(f"{x:.9f}" for x in lengths(**pose)))
