"""The transmission as a Mechanism: two freedoms without rows, or every part a body."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache

import numpy as np

from mechlab.catalog.impulse_transmission import looks
from mechlab.catalog.impulse_transmission.parameters import Parameters
from mechlab.errors import unknown
from mechlab.experiment.recording import Recording
from mechlab.mechanism import Builder, Inertia, Mechanism, as_fraction, revolute
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import Winding

NAME = "impulse_transmission"


@lru_cache(maxsize=64)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """minimal: carrier and one planet that stands for all, both shafts as Shafts. full: shafts, carrier, every planet."""
    b = Builder(
        NAME, gravity=(0.0, 0.0, 0.0), summary="inertial-impulse transmission: unbalanced planets on a free carrier"
    )
    if fidelity == "minimal":
        _minimal(b, p)
    elif fidelity == "full":
        _full(b, p)
    else:
        raise unknown(f"{NAME}: fidelity", fidelity, ("minimal", "full"))
    b.ground(*looks.frame(p))
    b.drive("alpha", winding=winding(p))
    return b.build()


def winding(p: Parameters) -> Winding:
    """The motor as a DC motor of torque constant 1, whose current is the torque: resistance nu wxx, inductance tau nu wxx."""
    resistance = p.impulse.speed_per_torque
    return Winding(1.0, resistance, 0.0 if p.static_motor else p.tau * resistance)


def voltage(p: Parameters) -> float:
    """Voltage of that DC motor at which the torque is Mn at the nominal speed."""
    return p.nominal_speed + p.impulse.speed_per_torque * p.Mn


def ratios(p: Parameters) -> tuple[Fraction, Fraction]:
    """a / k and b / k, exactly from the decimals as written."""
    a, b = as_fraction(p.a, "a"), as_fraction(p.b, "b")
    return a / (a + b), b / (a + b)


def _planet(p: Parameters, share: int) -> Inertia:
    """One planet of `share`: its mass centre lies h outwards at psi = 0, its moment is about the mass centre."""
    mass, moment = p.nm / share, max(0.0, (p.nJ3 - p.nm * p.h**2) / share)
    return Inertia(mass, (p.h, 0.0, 0.0), (0.5 * moment, 0.5 * moment, moment, 0.0, 0.0, 0.0))


def _terms(**coefficients: Fraction) -> Mapping[str, object]:
    return {name: c for name, c in coefficients.items() if c}


def _minimal(b: Builder, p: Parameters) -> None:
    a, other = ratios(p)
    b.body("carrier", revolute("theta"), shapes=looks.carrier(p))
    b.body("planet", revolute("psi"), parent="carrier", at=(p.a + p.b, 0.0, 0.0), inertia=_planet(p, 1))
    b.shaft("alpha", _terms(theta=Fraction(1), psi=other / p.q), inertia=p.J1, shapes=looks.input_shaft(p))
    b.shaft(
        "beta", _terms(theta=Fraction(1), psi=-a / p.q), inertia=p.J2, friction=p.M1, stiffness=p.c,
        shapes=looks.output_shaft(p),
    )  # fmt: skip
    for k in range(p.planets):
        place = looks.planet_placement(p, k)
        b.shaft(f"planet_{k + 1}", {"psi": 1}, body="carrier", placement=place, shapes=looks.planet(p))


def _full(b: Builder, p: Parameters) -> None:
    a, other = ratios(p)
    for body, joint, inertia, shapes in (
        ("input", revolute("alpha"), p.J1, looks.input_shaft(p)),
        ("output", revolute("beta", friction=p.M1, stiffness=p.c), p.J2, looks.output_shaft(p)),
    ):
        # About z only the moment matters; the mass of a shaft is that of a disc of the planets' orbit.
        mass = 2.0 * inertia / (p.a + p.b) ** 2
        b.body(body, joint, inertia=Inertia.axial(mass, inertia, 0.5 * inertia), shapes=shapes)
    b.body("carrier", revolute("theta"), shapes=looks.carrier(p))
    b.relation("carrier_speed", **_terms(theta=Fraction(1), alpha=-a, beta=-other))
    for k in range(p.planets):
        name, place = f"planet_{k + 1}", looks.planet_placement(p, k)
        b.body(
            name, revolute(name), parent="carrier", at=place.position, turned=looks.turn_of(p, k),
            inertia=_planet(p, p.planets), shapes=looks.planet(p),
        )  # fmt: skip
        b.relation(f"{name}_turn", **{name: Fraction(1), "alpha": -p.q, "beta": p.q})


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """Every planet along a recording of any fidelity."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    return full, full_coordinates(p, recording.channel("alpha"), recording.channel("beta"))


def full_coordinates(p: Parameters, alpha: Array, beta: Array) -> Array:
    """(n, nq) coordinates of `full` from both shaft angles (n,)."""
    a, other = (float(x) for x in ratios(p))
    values = {"alpha": alpha, "beta": beta, "theta": a * alpha + other * beta}
    psi = float(p.q) * (alpha - beta)
    return np.column_stack([values.get(j.name, psi) for j in build(p, "full").joints])


def minimal_coordinates(p: Parameters, alpha: Array, beta: Array) -> Array:
    """(n, 2) theta and psi from both shaft angles (n,); the same for rates."""
    a, other = (float(x) for x in ratios(p))
    return np.column_stack([a * alpha + other * beta, float(p.q) * (alpha - beta)])
