"""Checks A4 and A5: freedoms by rank, and the constant ratio of the cardan shafts."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.cardan_chain import cardan_chain, turned
from mechlab.catalog.delta6.graded import Quantity, graded
from mechlab.catalog.delta6.parameters import Delta6Parameters, drive_names
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import SOURCE, random_poses
from mechlab.catalog.delta6.witnesses import Witness, witnesses
from mechlab.experiment.entry import Check, CheckResult
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import rank, structure

EXPECTED = {"minimal": (15, 9, 9, 6, 0), "parts": (18, 12, 12, 6, 0), "full": (45, 36, 36, 9, 3)}
"""Coordinates, rows, rank, freedoms, freedoms that are left with all drives held."""


def _freedoms(w: Witness) -> list[int]:
    m, jacobian = w.mechanism, w.jacobian()
    held = np.vstack([jacobian, *(m.row(n) for n in drive_names())])
    return [m.nv, len(jacobian), rank(jacobian), m.nv - rank(jacobian), m.nv - rank(held)]


def a4(p: Delta6Parameters) -> CheckResult:
    """Mobility by rank at a generic pose, and the names of the local freedoms."""
    centre, angles = random_poses(p, 1, seed=11)
    counts: dict[str, list[int]] = {}
    for fidelity in EXPECTED:
        for w in witnesses(build(p, fidelity)):
            counts.setdefault(w.name, []).extend(_freedoms(w.at(coordinates(p, fidelity, centre, angles)[0])))
    idle = structure(build(p, "full")).idle
    named = [float(f"spin of plain_{i}" in idle) for i in (1, 2, 3)]
    return graded(
        Quantity("coordinates, rows, rank, freedoms, local ones: minimal, parts, full", 0.5, counts, sum(EXPECTED.values(), ())),
        Quantity("local freedoms are the spins of the plain rods", 0.5, {"numpy": [*named, len(idle)]}, [1.0, 1.0, 1.0, 3.0]),
    )  # fmt: skip


def _bend(p: Delta6Parameters) -> float:
    return float(closed.cardan_bend(p.geometry, np.zeros(3))[0])


def _swing(w: Witness, bend: float) -> float:
    """Half the swing of output - input [deg] with the forks 90 deg out of phase, from the two inputs where it is extreme.

    From the normal to rod and shaft, output - input is atan(cos^2(bend) tan(psi)) - psi, extreme at tan(psi) = +-1/cos(bend).
    """
    extreme = 0.5 * math.pi - math.atan(1.0 / math.cos(bend))
    inputs = np.array([-extreme, extreme])
    error = turned(w, inputs) - inputs
    return math.degrees(abs(error[1] - error[0])) / 2.0


def a5(p: Delta6Parameters) -> CheckResult:
    """A double cardan turned once: forks in phase, 45 and 90 deg out of phase, at the bend of the home pose."""
    bend = _bend(p)
    inputs = np.radians(np.arange(0.0, 361.0, 30.0))
    k = math.cos(bend) ** 2
    in_phase: dict[str, float] = {}
    out_of_phase: dict[str, Array] = {"analytic": _misphased(inputs, bend, 0.25 * math.pi)}
    swing = {"analytic": math.degrees(float(closed.misphase_amplitude(bend, 0.5 * math.pi)))}
    chains = [witnesses(cardan_chain(p.rod_length, bend, x)) for x in (0.0, 0.25 * math.pi, 0.5 * math.pi)]
    for good, half, worst in zip(*chains, strict=True):
        in_phase[good.name] = float(np.degrees(np.abs(turned(good, inputs) - inputs).max()))
        out_of_phase[half.name] = turned(half, inputs)
        swing[worst.name] = _swing(worst, bend)
    source = math.degrees(float(closed.misphase_amplitude(_bend(SOURCE), 0.5 * math.pi)))
    pins, step = inputs[:-1] + 0.1, 1e-5
    hooke = (_hooke(pins + step, bend) - _hooke(pins - step, bend)) / (2.0 * step)
    ratio = {"analytic": closed.rod_speed_ratio(bend, pins), "differences": hooke}
    # Newton closes the chains to 1e-13.
    return graded(
        Quantity("forks in phase: output - input [deg]", 1e-8, in_phase, 0.0),
        Quantity("45 deg out of phase: output [rad]", 1e-10, out_of_phase),
        Quantity(
            "90 deg out of phase: half the swing [deg]", 1e-8, swing, math.degrees(math.asin((1.0 - k) / (1.0 + k)))
        ),
        # central differences: 1e-10 of a third derivative, rounding 1e-16 / 1e-5
        Quantity("speed of the rod over that of its shaft", 1e-8, ratio),
        Quantity("the same at the bend of the source, 38.045 deg [deg]", 1e-3, {"analytic": source}, 13.557),
        note=f"bend {math.degrees(bend):.4g} deg",
    )


def _hooke(pin: Array, bend: float) -> Array:
    """Turn of the rod behind a cross joint; the driving pin stands `pin` from the normal to shaft and rod."""
    return np.asarray(np.unwrap(np.arctan2(np.cos(bend) * np.sin(pin), np.cos(pin))))


def _misphased(inputs: Array, bend: float, misphase: float) -> Array:
    """Closed form of the output; the fork pin of the reference pose stands at 90 deg to the normal of rod and shaft."""
    start = 0.5 * math.pi
    turn = closed.misphase_output(inputs + start, bend, -misphase) - closed.misphase_output(start, bend, -misphase)
    return np.asarray(turn)


CHECKS = (
    Check("A4", "degrees of freedom by rank: 6, 6, and 9 = 6 + 3 local", a4, "rank of the constraint Jacobian"),
    Check("A5", "the cardan shafts pass rotation on at a constant ratio, with their forks in phase only", a5,
          "specification, section 4"),
)  # fmt: skip
