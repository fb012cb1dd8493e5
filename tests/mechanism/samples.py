"""Mechanisms that the tests of this room share."""

from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, floating, prismatic, revolute, spherical
from mechlab.mechanism.geometry import frame_along

PART = Inertia(1.3, (0.1, -0.05, 0.02), (0.02, 0.03, 0.025, 0.001, -0.002, 0.0005))


def two_chains(kind: str) -> Mechanism:
    """Two open chains with all joint kinds, closed at their ends by a loop of the given kind."""
    b = Builder("chains")
    b.body("a1", revolute("r1", (1, 2, 2)), inertia=PART)
    b.body("a2", prismatic("p1", "x"), revolute("r2", "y"), parent="a1", at=(0.3, 0, 0.1), inertia=PART)
    b.body("b1", spherical("s1"), at=(0.6, 0.1, 0), inertia=PART)
    b.body("b2", *floating("f"), parent="b1", at=(0, 0.2, 0.1), inertia=PART)
    ends = {"a2": (0.2, 0.1, 0.0), "b2": (-0.1, -0.1, 0.1)}
    if kind == "distance":
        from mechlab.mechanism import Loop

        gap = _gap(ends)
        b.close_here(Loop("tie", kind, "a2", "b2", Placement(ends["a2"]), Placement(ends["b2"]), gap))
        return b.build()
    target = (0.5, 0.1, 0.1)  # where a2's end stands in the world
    origin_b = (0.6, 0.3, 0.1)
    local_b = tuple(t - o for t, o in zip(target, origin_b, strict=True))
    frame = frame_along((0.0, 0.6, 0.8))
    from mechlab.mechanism import Loop

    b.close_here(Loop("tie", kind, "a2", "b2", Placement.of(frame, ends["a2"]), Placement.of(frame, local_b)))
    return b.build()


def _gap(ends: dict[str, tuple[float, float, float]]) -> float:
    a = [0.3 + ends["a2"][0], ends["a2"][1], 0.1 + ends["a2"][2]]
    b = [0.6 + ends["b2"][0], 0.3 + ends["b2"][1], 0.1 + ends["b2"][2]]
    return sum((x - y) ** 2 for x, y in zip(a, b, strict=True)) ** 0.5


def fourbar(crank: float = 0.1, coupler: float = 0.3, rocker: float = 0.25, ground: float = 0.3) -> Mechanism:
    """A planar four-bar in the xy plane, crank at 1 rad, the coupler-rocker joint above."""
    b = Builder("fourbar", gravity=(0, -9.81, 0))
    b.bar("crank", revolute("crank"), crank)
    b.bar("coupler", revolute("coupler"), coupler, parent="crank", at=(crank, 0, 0))
    b.bar("rocker", revolute("rocker"), rocker, at=(ground, 0, 0))
    b.loop("pin", "coupler", "rocker", (coupler, 0, 0), (rocker, 0, 0))
    b.drive("crank")
    return b.assemble({"crank": 1.0, "coupler": -0.4, "rocker": 1.5}, hold=["crank"])


def planetary(planets: int = 3, teeth: tuple[int, int, int] = (24, 30, 84)) -> Mechanism:
    """Sun, carrier, ring and planets, all free."""
    import math

    sun, planet, ring = teeth
    b = Builder("stage")
    disc = Inertia.cylinder(1.0, 0.05, 0.02)
    for name in ("sun", "carrier", "ring"):
        b.body(name, revolute(name), inertia=disc)
    for k in range(planets):
        a = 2 * math.pi * k / planets
        b.body(f"planet_{k}", revolute(f"planet_{k}"), parent="carrier", at=(math.cos(a), math.sin(a), 0), inertia=disc)
        b.gears(f"inner_{k}", "sun", f"planet_{k}", (sun, planet), carrier="carrier")
        b.gears(f"outer_{k}", "ring", f"planet_{k}", (ring, planet), carrier="carrier", kind="internal")
    return b.build()
