"""Small mechanisms used by several tests of this room."""

import numpy as np

from mechlab.mechanism import Builder, Inertia, revolute


def fourbar():
    b = Builder("fourbar", gravity=(0, -9.81, 0))
    b.bar("crank", revolute("crank_angle"), 0.1)
    b.bar("coupler", revolute("coupler_rel"), 0.3, parent="crank", at=(0.1, 0, 0))
    b.bar("rocker", revolute("rocker_angle"), 0.25, at=(0.3, 0, 0))
    b.loop("pin", "coupler", "rocker", (0.3, 0, 0), (0.25, 0, 0))
    b.drive("crank_angle")
    b.frame("point", "coupler", (0.15, 0.05, 0.0))
    return b.assemble({"crank_angle": 0.9, "coupler_rel": -0.3, "rocker_angle": 1.5}, hold=["crank_angle"])


def planetary(planets=3):
    b = Builder("stage", gravity=(0, -9.81, 0))
    b.body("sun", revolute("sun"), inertia=Inertia.cylinder(1, 0.03, 0.02))
    b.body("carrier", revolute("carrier"), inertia=Inertia.cylinder(1, 0.05, 0.01))
    b.body("ring", revolute("ring"), inertia=Inertia.cylinder(1, 0.09, 0.01))
    for i in range(planets):
        a = 2 * np.pi * i / planets
        b.body(
            f"planet_{i}",
            revolute(f"planet_{i}"),
            parent="carrier",
            at=(0.054 * np.cos(a), 0.054 * np.sin(a), 0),
            inertia=Inertia.cylinder(0.3, 0.02, 0.02),
        )
        b.gears(f"sun_planet_{i}", "sun", f"planet_{i}", (24, 30), "carrier")
        b.gears(f"ring_planet_{i}", "ring", f"planet_{i}", (84, 30), "carrier", kind="internal")
    return b.build()


def scara():
    """Two links in a plane and a spring and damper: an open chain with a frame at its tip."""
    b = Builder("scara", gravity=(0, -9.81, 0))
    b.bar("upper", revolute("shoulder"), 0.3)
    b.bar("lower", revolute("elbow"), 0.2, parent="upper", at=(0.3, 0, 0))
    b.frame("tip", "lower", (0.2, 0, 0))
    b.drive("shoulder")
    b.drive("elbow")
    return b.assemble({"shoulder": 0.4, "elbow": 0.9}, hold=["shoulder", "elbow"])
