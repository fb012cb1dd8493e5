"""The three-gear four-bar at moving states in particles, and the check on it."""

from __future__ import annotations

import cmath
import math

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.gear_linkage.build import build
from mechlab.catalog.gear_linkage.parameters import Parameters
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit import mass_check
from mechlab.kit.benchmark_parts import in_plane
from mechlab.kit.mass_check import Particles, State, rod, solid
from mechlab.mechanism.geometry import axis_rotation

STATES = ((0.6, 1.3), (2.5, -0.8))
"""Crank angle [rad] and rate [rad/s]: one behind the reference pose, one ahead."""


def state(p: Parameters, phi: float, w: float) -> State:
    """A crank angle and rate: bars between the moving pins A, B, C, D, uniform discs about B, C, D."""
    x = closed_form.motion(p.linkage, phi, w)
    turns = {n: float(getattr(x, f"{n}_angle")) for n in ("coupler", "rocker", "idler", "output")}
    rates = {n: float(getattr(x, f"{n}_rate")) for n in turns}
    ra, rc, rd = p.linkage.radii
    pin_b, pin_d = cmath.rect(p.crank, phi), complex(p.frame)
    pin_c = pin_d + cmath.rect(p.rocker, turns["rocker"])
    vb, vc = 1j * w * pin_b, 1j * rates["rocker"] * (pin_c - pin_d)
    ends = {"A": (0j, 0j), "B": (pin_b, vb), "C": (pin_c, vc), "D": (pin_d, 0j)}

    def bar(a: str, b: str, length: float) -> Particles:
        (pa, va), (pb, vb) = ends[a], ends[b]
        return rod(p.mass_per_length * length, in_plane(pa), in_plane(pb), in_plane(va), in_plane(vb))

    def gear(at: str, radius: float, rate: float) -> Particles:
        place, velocity = (in_plane(z) for z in ends[at])
        mass = p.mass_per_area * math.pi * radius**2
        return solid(mass, place, (0.5 * radius, 0.5 * radius, 0.0), velocity=velocity, turn=(0.0, 0.0, rate))

    particles = bar("A", "B", p.crank) + bar("B", "C", p.coupler) + bar("D", "C", p.rocker)
    particles = particles + gear("B", ra, w) + gear("C", rc, rates["idler"]) + gear("D", rd, rates["output"])
    joint = turns["coupler"] - phi
    values = {
        "crank_angle": phi, "coupler_joint": joint, "idler_joint": ra / rc * joint, "rocker_angle": turns["rocker"],
        "output_angle": turns["output"], "coupler_angle": turns["coupler"], "idler_angle": turns["idler"],
    }  # fmt: skip
    speeds = {f"{n}_angle": v for n, v in rates.items()}
    speeds |= {
        "crank_angle": w,
        "coupler_joint": rates["coupler"] - w,
        "idler_joint": rates["idler"] - rates["coupler"],
    }
    rim = pin_d + cmath.rect(rd, turns["output"])
    points = {"B": in_plane(pin_b), "C": in_plane(pin_c), "rim": in_plane(rim)}
    # No mass feels how the teeth of the idler stand: its body has turned with the coupler, and by its joint against it.
    idler = axis_rotation((0.0, 0.0, 1.0), turns["coupler"] + ra / rc * joint)
    poses = {"idler": (idler, np.array(in_plane(pin_c)))}
    return State(values, speeds, particles, points, (0.0, 0.0, 0.0), 1, poses=poses)


def _moving(p: Parameters) -> CheckResult:
    m = build(p, "minimal")
    return mass_check.compare([(m, state(p, phi, w)) for phi, w in STATES])


MOVING = Check("L10", mass_check.TEXT, _moving, mass_check.SOURCE)
