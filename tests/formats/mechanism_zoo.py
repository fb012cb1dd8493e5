"""Mechanisms for the tests of the formats: random trees, loops of every kind, an arm, a four-bar, a planetary stage."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from mechlab.mechanism import (
    Body,
    Builder,
    Frame,
    Inertia,
    Loop,
    Mechanism,
    Placement,
    Spring,
    TreeKinematics,
    integrate,
    prismatic,
    revolute,
    shape,
    spherical,
    universal,
)
from mechlab.mechanism.geometry import axis_rotation

LOOPS = ("spherical", "revolute", "fixed", "universal", "cylindrical", "prismatic", "distance")


def direction(rng):
    v = rng.normal(size=3)
    return tuple((v / np.linalg.norm(v)).tolist())


def placement(rng):
    return Placement(tuple(rng.uniform(-0.3, 0.3, 3).tolist()), tuple(rng.normal(size=4).tolist()))


def inertia(rng, flat=False):
    p = 10 ** rng.uniform(-4, -2, 3)
    if flat:
        p[2] = 0.0
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    t = (q @ np.diag([p[1] + p[2], p[0] + p[2], p[0] + p[1]]) @ q.T).tolist()
    com = tuple(rng.uniform(-0.1, 0.1, 3).tolist())
    return Inertia(float(rng.uniform(0.1, 2)), com, (t[0][0], t[1][1], t[2][2], t[0][1], t[0][2], t[1][2]))


def tree(seed, kinds=("revolute", "prismatic", "spherical"), shafts=True, armature=True):
    """A random tree with compound joints, flat bodies, welded bodies, springs, and shafts over joints of one path."""
    rng = np.random.default_rng(seed)
    b = Builder("tree", gravity=tuple(rng.uniform(-10, 10, 3)))
    names, path = ["ground"], {"ground": []}
    for i in range(int(rng.integers(2, 10))):
        parent = names[int(rng.integers(len(names)))]
        joints = []
        for k in range(int(rng.integers(1, 4))):
            options = {
                "armature": float(rng.uniform(0, 0.01)) if armature else 0.0,
                "damping": float(rng.uniform(0, 0.1)),
            }
            kind = kinds[int(rng.integers(len(kinds)))]
            if kind == "revolute":
                joints.append(
                    revolute(f"j{i}_{k}", direction(rng), zero=float(rng.normal()), range=(-9.0, 7.5), **options)
                )
            elif kind == "prismatic":
                joints.append(prismatic(f"j{i}_{k}", direction(rng), stiffness=2.0, spring_rest=0.1, **options))
            else:
                joints.append(spherical(f"j{i}_{k}", **options))
        if i and rng.uniform() < 0.2:
            joints = []
        name = f"b{i}"
        b.bodies.append(Body(name, parent, placement(rng), tuple(joints), inertia(rng, rng.uniform() < 0.3)))
        names.append(name)
        path[name] = path[parent] + [j.name for j in joints if j.kind != "spherical"]
        if shafts and len(path[name]) >= 2:
            used = rng.choice(path[name], size=min(3, len(path[name])), replace=False)
            c = {str(u): Fraction(int(rng.integers(1, 9)), int(rng.integers(-9, 0))) for u in used}
            b.shaft(
                f"s{i}", c, inertia=float(rng.uniform(0, 0.1)), damping=0.01, stiffness=0.5, spring_rest=0.2, zero=0.3
            )
    b.frames.append(Frame("tip", names[-1], placement(rng)))
    return b.build()


def looped(kind, seed=5):
    """Two random arms from the ground, closed by one loop of a kind, its two ends at different angles and offsets."""
    rng = np.random.default_rng(seed)
    b = Builder("looped", gravity=(1, 2, -9.81))
    b.bodies.append(
        Body("a1", "ground", placement(rng), universal("q1", "q2", direction(rng), direction(rng)), inertia(rng))
    )
    joints = (revolute("q3", direction(rng)), prismatic("q4", direction(rng)))
    b.bodies.append(Body("a2", "a1", placement(rng), joints, inertia(rng)))
    b.bodies.append(Body("a3", "a2", placement(rng), (spherical("q5"),), inertia(rng)))
    b.bodies.append(Body("b1", "ground", placement(rng), (revolute("q6", direction(rng)),), inertia(rng)))
    pose = TreeKinematics(b.build())
    end = placement(rng)
    r, p = pose.pose("a3")
    at, turned = p + r @ end.translation, r @ end.rotation
    length = 0.0
    if kind in ("cylindrical", "prismatic"):
        at = at + 0.07 * turned[:, 2]
    if kind in ("cylindrical", "revolute"):
        turned = turned @ axis_rotation((0, 0, 1), 0.7)
    if kind == "universal":
        turned = turned @ axis_rotation((1, 0, 0), 0.4) @ axis_rotation((0, 1, 0), 0.6)
    if kind == "distance":
        gap = 0.3 * rng.normal(size=3)
        at, length = at + gap, float(np.linalg.norm(gap))
    rb, pb = pose.pose("b1")
    b.close_here(Loop("pin", kind, "a3", "b1", end, Placement.of(rb.T @ turned, rb.T @ (at - pb)), length))
    return b.build()


def arm():
    """A driven arm: servos on joints and on a shaft, a spring to the ground, ranges, zeros, shapes, a frame."""
    b = Builder("arm", summary="a driven arm")
    b.body("base", revolute("yaw", "z"), inertia=Inertia.cylinder(2, 0.05, 0.1))
    beam = shape("box", x=0.1, y=0.02, z=0.02)
    joint = revolute("pitch", "y", zero=0.3, range=(-1, 1.5), damping=0.1, friction=0.01)
    b.body(
        "beam",
        joint,
        parent="base",
        at=(0, 0, 0.1),
        inertia=Inertia.rod(1, (0, 0, 0), (0.4, 0, 0), 0.01),
        shapes=[beam],
    )
    slide = prismatic("slide", "x", stiffness=50, spring_rest=0.02)
    rod = shape("cylinder", radius=0.02, length=0.2)
    b.body("slider", slide, parent="beam", at=(0.4, 0, 0), inertia=Inertia.point(0.5, (0.05, 0, 0)), shapes=[rod])
    wheel = Inertia.cylinder(0.3, 0.05, 0.02, (0, 1, 0), (0.01, 0, 0))
    gear = shape("disc", radius=0.05, thickness=0.02)
    b.body("wheel", revolute("wheel", "y"), parent="slider", at=(0.05, 0, 0.02), inertia=wheel, shapes=[gear])
    b.shaft("rotor", {"wheel": 3, "pitch": "-1/2"}, inertia=1e-4, zero=0.2)
    b.drive("yaw", 500, 5)
    b.drive("pitch", 800, 8)
    b.drive("slide", 3000, 20)
    b.drive("rotor", 20, 0.2, limit=5, name="motor")
    b.frame("tip", "slider", (0.1, 0, 0))
    b.spring(Spring("coil", "ground", "slider", (0, 0, 1), (0, 0, 0), 100, 1, 0.3))
    b.ground(shape("sphere", radius=0.01))
    return b.build()


def fourbar():
    b = Builder("fourbar", gravity=(0, -9.81, 0))
    b.bar("crank", revolute("crank"), 0.1)
    b.bar("coupler", revolute("coupler"), 0.3, parent="crank", at=(0.1, 0, 0))
    b.bar("rocker", revolute("rocker"), 0.25, at=(0.3, 0, 0))
    b.loop("pin", "coupler", "rocker", (0.3, 0, 0), (0.25, 0, 0))
    b.drive("crank", 50, 1)
    return b.assemble({"crank": 0.9, "coupler": -0.3, "rocker": 1.5}, hold=["crank"])


def planetary():
    b = Builder("stage")
    for name, radius in (("sun", 0.03), ("carrier", 0.05), ("ring", 0.09)):
        b.body(name, revolute(name), inertia=Inertia.cylinder(1, radius, 0.02))
    for i in range(3):
        a = 2 * np.pi * i / 3
        at = (0.054 * np.cos(a), 0.054 * np.sin(a), 0)
        b.body(
            f"planet_{i}", revolute(f"planet_{i}"), parent="carrier", at=at, inertia=Inertia.cylinder(0.3, 0.02, 0.02)
        )
        b.gears(f"sun_planet_{i}", "sun", f"planet_{i}", (24, 30), "carrier")
        b.gears(f"ring_planet_{i}", "ring", f"planet_{i}", (84, 30), "carrier", kind="internal")
    b.drive("sun")
    return b.build()


ALL = {"arm": arm, "fourbar": fourbar, "planetary": planetary} | {k: (lambda k=k: looped(k)) for k in LOOPS}


def state(m: Mechanism, seed: int):
    rng = np.random.default_rng(seed)
    return integrate(m, m.reference(), rng.normal(size=m.nv)), rng.normal(size=m.nv)


__all__ = ["ALL", "LOOPS", "arm", "fourbar", "looped", "planetary", "state", "tree"]
