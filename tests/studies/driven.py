"""Mechanisms with drives, one of each kind, for the tests of what acts."""

from __future__ import annotations

import numpy as np

from mechlab.formats import from_mjcf
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, floating, prismatic, revolute, universal
from mechlab.mechanism.geometry import frame_along
from mechlab.mechanism.parts import Spring, Winding


def arm(
    stiffness: float = 500.0, damping: float = 20.0, gravity: float = 9.81, limit: float | None = None
) -> Mechanism:
    """A point mass of .5 kg at .4 m, about y: inertia .08 kg m2, and a servo on its joint."""
    b = Builder("arm", gravity=(0.0, 0.0, -gravity))
    b.body("arm", revolute("q", "y"), inertia=Inertia.point(0.5, (0.4, 0.0, 0.0)))
    return b.drive("q", stiffness, damping, limit).build()


def stewart(stiffness: float = 1e5) -> Mechanism:
    """Six legs with universal joints below, slides between, balls above; a plate of 5 kg on a floating body."""
    b = Builder("stewart")
    plate = Inertia.point(2.5, (0.1, 0.1, 0.0)) + Inertia.point(2.5, (-0.1, -0.1, 0.05)) + Inertia.axial(1.0, 0.1, 0.05)
    b.body("plate", *floating("p"), at=(0.0, 0.0, 0.6), inertia=plate)
    rod = Inertia.point(0.1, (0.01, 0.0, 0.1)) + Inertia.point(0.1, (-0.01, 0.01, 0.2))
    for k in range(6):
        side = 1.0 if k % 2 else -1.0
        low = 2 * (k // 2) * np.pi / 3 + 0.3 * side
        high = 2 * (k // 2) * np.pi / 3 + (np.pi / 3 - 0.3) * side
        foot = np.array([0.5 * np.cos(low), 0.5 * np.sin(low), 0.0])
        ball = np.array([0.3 * np.cos(high), 0.3 * np.sin(high), 0.0])
        along = ball + [0.0, 0.0, 0.6] - foot
        turned = Placement.of(frame_along(along / np.linalg.norm(along)), (0.0, 0.0, 0.0))
        b.body(f"low_{k}", *universal(f"u_{k}", f"w_{k}"), at=tuple(foot), turned=turned, inertia=rod)
        b.body(f"high_{k}", prismatic(f"s_{k}"), parent=f"low_{k}", inertia=rod)
        b.loop(f"ball_{k}", f"high_{k}", "plate", (0.0, 0.0, float(np.linalg.norm(along))), tuple(ball))
        b.drive(f"s_{k}", stiffness, 1e3)
    return b.build()


def palletizer(stiffness: float = 2000.0, damping: float = 100.0) -> Mechanism:
    """Two light links, each with a stiff servo: rates of 1e5 1/s, which no explicit method of usual step can take."""
    b = Builder("palletizer")
    b.bar("arm", revolute("q", "y"), 0.3, mass=0.1)
    b.bar("fore", revolute("r", "y"), 0.3, mass=0.1, parent="arm", at=(0.3, 0.0, 0.0))
    return b.drive("q", stiffness, damping).drive("r", stiffness, damping).build()


def slider_crank() -> Mechanism:
    """A crank, a rod and a slide that a servo holds."""
    b = Builder("slider")
    b.bar("crank", revolute("crank", "y"), 0.2, mass=0.3)
    b.bar("rod", revolute("rod", "y"), 0.5, mass=0.4, parent="crank", at=(0.2, 0.0, 0.0))
    b.body("slide", prismatic("slide", "x"), inertia=Inertia.point(0.5, (0.01, 0.0, 0.0)))
    b.loop("pin", "rod", "slide", (0.5, 0.0, 0.0), (0.0, 0.0, 0.0))
    b.drive("slide", 2000.0, 30.0)
    return b.assemble({"crank": -0.8, "rod": 1.2, "slide": 0.6})


def geared() -> Mechanism:
    """Two wheels with a weight on the second; the drive sits on the first."""
    b = Builder("geared")
    b.body("small", revolute("small", "y"), inertia=Inertia.axial(0.5, 1e-3, 1e-3))
    b.body("large", revolute("large", "y"), at=(0.4, 0, 0), inertia=Inertia.point(1.0, (0.2, 0.0, 0.0)))
    return b.gears("mesh", "small", "large", (1, 3)).drive("small", 20.0, 0.5).build()


def shafted() -> Mechanism:
    """A double pendulum and a motor shaft that turns with both joints; the servo is on the shaft."""
    b = Builder("shafted")
    b.bar("upper", revolute("a", "y"), 0.3, mass=0.5)
    b.bar("lower", revolute("b", "y"), 0.3, mass=0.5, parent="upper", at=(0.3, 0.0, 0.0))
    b.shaft("rotor", {"a": 2, "b": 5}, inertia=0.01, zero=0.7)
    return b.drive("rotor", 40.0, 1.0).drive("a", 100.0, 3.0).build()


def cardan() -> Mechanism:
    """Two forks joined by a universal loop; a weight on the second, the drive on the first."""
    b = Builder("cardan")
    b.body("input", revolute("turn_in", "x"), inertia=Inertia.axial(1.0, 0.02, 0.02))
    bent = Placement.of(np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]), (0.0, 0.0, 0.0))
    weight = Inertia.point(1.0, (0.1, 0.2, 0.0)) + Inertia.axial(1.0, 0.02, 0.02)
    b.body("output", revolute("turn_out", "x"), turned=bent, inertia=weight)
    b.loop("cross", "input", "output", kind="universal", axis_a="z", axis_b="y")
    return b.drive("turn_in", 60.0, 0.8).build()


def two_branches() -> Mechanism:
    """A tree with a stiff drive and a soft one."""
    b = Builder("branches")
    b.bar("left", revolute("left", "y"), 0.4, mass=1.0)
    b.bar("right", revolute("right", "y"), 0.3, mass=0.5, parent="left", at=(0.4, 0.0, 0.0))
    b.bar("other", revolute("other", "x"), 0.3, mass=0.5, parent="left", at=(0.2, 0.0, 0.0))
    return b.drive("left", 5000.0, 40.0).drive("right", 2.0, 0.05).build()


def damper() -> Mechanism:
    """A drive with damping alone: it sinks."""
    b = Builder("damper")
    b.bar("arm", revolute("q", "y"), 0.4, mass=1.0)
    return b.drive("q", damping=3.0).build()


def armature() -> Mechanism:
    """A rotor of .2 kg m2 in the joint, a limit that the weight passes."""
    b = Builder("armature")
    b.bar("arm", revolute("q", "y", armature=0.2, damping=0.1), 0.4, mass=1.0)
    return b.drive("q", 300.0, 8.0, limit=1.5).build()


def sprung_loop() -> Mechanism:
    """A four-bar with a spring across, held at the crank; the crank has a physical zero of its own."""
    b = Builder("sprung")
    b.bar("crank", revolute("crank", "y", zero=0.3), 0.1, mass=0.2)
    b.bar("coupler", revolute("coupler", "y"), 0.4, mass=0.5, parent="crank", at=(0.1, 0.0, 0.0))
    b.bar("rocker", revolute("rocker", "y"), 0.3, mass=0.4, at=(0.35, 0.0, 0.0))
    b.loop("pin", "coupler", "rocker", (0.4, 0.0, 0.0), (0.3, 0.0, 0.0))
    b.spring(Spring("spring", "ground", "coupler", (0.0, 0.0, 0.3), (0.2, 0.0, 0.0), 200.0, 2.0, 0.1))
    return b.drive("crank", 30.0, 0.5).assemble({"crank": -1.0, "coupler": 0.6, "rocker": -1.2})


def wound() -> Mechanism:
    """A DC motor without inductance: at no voltage it brakes."""
    b = Builder("wound")
    b.bar("arm", revolute("q", "y"), 0.4, mass=1.0)
    return b.drive("q", winding=Winding(0.5, 0.4)).build()


STRANGER = """<mujoco model="stranger">
  <option timestep="0.002"/>
  <worldbody>
    <body name="arm"><joint name="q" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .4 0 0" size=".02" mass="1"/>
      <body name="fore" pos=".4 0 0"><joint name="r" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".02" mass=".5"/>
      </body>
    </body>
  </worldbody>
  <actuator><position name="p" joint="q" kp="200" kv="5"/><velocity name="v" joint="r" kv="2"/></actuator>
</mujoco>"""


def stranger() -> Mechanism:
    """Read from somebody's MJCF: a position and a velocity servo."""
    return from_mjcf(STRANGER)


ALL = (
    arm, stewart, palletizer, slider_crank, geared, shafted, cardan, two_branches, damper, armature, sprung_loop, wound,
    stranger,
)  # fmt: skip
