"""The squeezer at moving states in particles, and the check on it."""

from __future__ import annotations

import cmath

import numpy as np

from mechlab.catalog.andrews.build import build
from mechlab.catalog.andrews.parameters import JOINTS, Parameters, own
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit import benchmark_parts as parts
from mechlab.kit import mass_check


def moving(p: Parameters, angle: float, speed: float) -> mass_check.State:
    """The closed form at a crank angle and speed in particles; the spring's power from the way of its end."""
    jets, pins = own(p).pose(angle)
    turn = {n: j.value.real for n, j in jets.items()}
    rate = {n: j.first.real * speed for n, j in jets.items()}
    ends = {n: (j.value, j.first * speed) for n, j in pins.items()}
    ends |= {"O": (0j, 0j), "A": (complex(*p.a), 0j), "B": (complex(*p.b), 0j)}

    def point(body: str, pin: str, at: complex) -> tuple[complex, complex]:
        """A point of a body, `at` from a pin of it, and its velocity."""
        (place, velocity), arm = ends[pin], at * cmath.rect(1.0, turn[body])
        return place + arm, velocity + 1j * rate[body] * arm

    centres = {
        "K1": ("O", complex(p.ra)), "K2": ("F", complex(p.da)), "K3": ("B", complex(p.sa, p.sb)), "K4": ("G", p.e - p.ea + 0j),
        "K5": ("A", complex(p.ta, p.tb)), "K6": ("H", p.zf - p.fa + 0j), "K7": ("A", complex(p.ua, p.ub)),
    }  # fmt: skip
    particles = mass_check.NOTHING
    for (body, where), mass, moment in zip(centres.items(), p.masses, p.inertias, strict=True):
        particles = particles + parts.planar_particles(mass, moment, *point(body, *where), turn[body], rate[body])
    d, d_rate = point("K3", "B", complex(p.sc, p.sd))
    way = d - complex(*p.c)
    pull = p.spring_stiffness * (abs(way) - p.spring_length) * way / abs(way)
    q, v = own(p).states(np.array([[angle, speed]]))
    points = {"F": ends["F"][0], "E": ends["E"][0], "D": d}
    return mass_check.State(
        dict(zip(JOINTS, q[0], strict=True)), dict(zip(JOINTS, v[0], strict=True)), particles,
        {n: parts.in_plane(z) for n, z in points.items()}, (0.0, -p.gravity, 0.0), 1,
        stored=(pull.conjugate() * d_rate).real,
    )  # fmt: skip


def _check(p: Parameters) -> CheckResult:
    m = build(p, "full")
    states = (moving(p, p.start_angle + 0.4, 1.3), moving(p, p.start_angle + 2.5, -0.8))
    return mass_check.compare([(m, state) for state in states])


MOVING = Check("B4", mass_check.TEXT, _check, mass_check.SOURCE)
