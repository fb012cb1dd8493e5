"""The inertial-impulse transmission: parameters, shapes, and the Mechanism: two coordinates, or every part a body.

The source prints no drawing to scale: the radii of the shapes follow the inertias and the offset h.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from mechlab.analytic.impulse import Impulse, resonances
from mechlab.errors import unknown
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.kit.palette import BLUE, BRASS, DARK, RED, STEEL
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, as_fraction, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.parts import Shape, Winding

X = (1.0, 0.0, 0.0)


def orbit(p: Parameters) -> float:
    """Radius of the planet axes [m]."""
    return p.a + p.b


def _planet_radius(p: Parameters) -> float:
    """Radius of a planet wheel [m], as large as its neighbours allow."""
    room = orbit(p) * (math.sin(math.pi / p.planets) if p.planets > 1 else 1.0)
    return 0.9 * min(room, 0.7 * orbit(p))


def turn_of(p: Parameters, k: int) -> Placement:
    """Planet k turned so that its mass centre lies outwards at psi = 0."""
    return Placement.of(axis_rotation((0.0, 0.0, 1.0), 2.0 * math.pi * k / p.planets), (0.0, 0.0, 0.0))


def planet_placement(p: Parameters, k: int) -> Placement:
    """Axis of planet k on the carrier."""
    angle = 2.0 * math.pi * k / p.planets
    at = (orbit(p) * math.cos(angle), orbit(p) * math.sin(angle), 0.0)
    return Placement.of(axis_rotation((0.0, 0.0, 1.0), angle), at)


def planet(p: Parameters) -> tuple[Shape, ...]:
    """A planet wheel with its eccentric weight, drawn inside the wheel."""
    r, w = _planet_radius(p), 0.25 * orbit(p)
    off = min(p.h, 0.55 * r)
    return (
        shape("disc", color=STEEL, name="planet", radius=r, thickness=w, bore=0.12 * r),
        shape("cylinder", Placement((off, 0.0, 0.0)), BRASS, "weight", radius=0.32 * r, length=1.5 * w),
    )


def carrier(p: Parameters) -> tuple[Shape, ...]:
    """Hub and one arm and pin for each planet, behind the planets."""
    k, w = orbit(p), 0.25 * orbit(p)
    out = [shape("disc", Placement((0.0, 0.0, -w)), RED, "hub", radius=0.25 * k, thickness=0.4 * w)]
    for i in range(p.planets):
        angle = 2.0 * math.pi * i / p.planets
        arm = Placement.of(axis_rotation((0.0, 0.0, 1.0), angle), (0.0, 0.0, -w))
        size = {"length": k, "width": 0.2 * k, "thickness": 0.4 * w, "bore": 0.04 * k}
        out.append(shape("link", arm, RED, f"arm_{i + 1}", **size))
        at = (k * math.cos(angle), k * math.sin(angle), -0.3 * w)
        out.append(shape("cylinder", Placement(at), DARK, f"pin_{i + 1}", radius=0.04 * k, length=2.2 * w))
    return tuple(out)


def input_shaft(p: Parameters) -> tuple[Shape, ...]:
    """The driving shaft, behind, with a flywheel and a mark that shows its turn."""
    return _shaft(p, -1.0, BLUE, "input")


def output_shaft(p: Parameters) -> tuple[Shape, ...]:
    """The driven shaft (reactor), in front."""
    return _shaft(p, 1.0, BRASS, "output")


def _shaft(p: Parameters, side: float, color: tuple[float, float, float, float], name: str) -> tuple[Shape, ...]:
    k = orbit(p)
    return (
        shape(
            "disc",
            Placement((0.0, 0.0, 0.6 * side * k)),
            color,
            name,
            radius=0.5 * k,
            thickness=0.15 * k,
            bore=0.05 * k,
        ),
        shape("cylinder", Placement((0.0, 0.0, 0.9 * side * k)), color, "shaft", radius=0.12 * k, length=0.9 * k),
        shape("box", Placement((0.36 * k, 0.0, 0.68 * side * k)), DARK, "mark", x=0.2 * k, y=0.05 * k, z=0.04 * k),
    )


def frame(p: Parameters) -> tuple[Shape, ...]:
    """A bearing around each shaft."""
    k = orbit(p)
    return tuple(
        shape("tube", Placement((0.0, 0.0, z)), DARK, name, outer=0.22 * k, inner=0.14 * k, length=0.15 * k)
        for z, name in ((-1.2 * k, "bearing_1"), (1.2 * k, "bearing_2"))
    )


SET_4 = "set (4) of the source"
FASTEST_LAG = 2e-5
"""Below this motor time constant [s] the torque follows the static characteristic: its lag is shorter than any step."""


@dataclass(frozen=True)
class Parameters:
    """Inertias, geometry, load, motor, and the state at t = 0."""

    J1: float = parameter(14.0, "kg m2", "input shaft", source=SET_4, low=0, strict=True)
    J2: float = parameter(0.5, "kg m2", "output shaft", source=SET_4, low=0, strict=True)
    nJ3: float = parameter(
        0.25, "kg m2", "all planets, about their geometric centres", source=SET_4, low=0, strict=True
    )
    nm: float = parameter(8.0, "kg", "mass of all planets", source=SET_4, low=0, strict=True)
    a: float = parameter(0.02, "m", "share of the input speed in the planet centres' speed", source=SET_4)
    b: float = parameter(0.08, "m", "share of the output speed; a + b is the radius of the planet axes", source=SET_4)
    h: float = parameter(0.083, "m", "offset of a planet's mass centre from its axis", source=SET_4, low=0)
    q: Fraction = parameter(Fraction(4, 3), "", "turns of a planet on the carrier per turn of input against output")
    M0: float = parameter(18.0, "N m", "constant load on the output shaft", source=SET_4, low=0)
    M1: float = parameter(750.0, "N m", "dry friction on the output shaft", source=SET_4, low=0)
    Mn: float = parameter(150.0, "N m", "motor torque at the nominal speed", source=SET_4)
    no_load_speed: float = parameter(220.0, "rad/s", "motor speed without torque", source=SET_4)
    nominal_speed: float = parameter(215.0, "rad/s", "motor speed at the torque Mn", source=SET_4)
    tau: float = parameter(0.038, "s", "time constant of the motor torque; 0: static", source=SET_4, low=0)
    slip_per_torque: float | None = parameter(
        None,
        "1/(N m)",
        "relative loss of speed per torque; none: the value that gives no torque at no_load_speed",
        low=0,
    )
    c: float = parameter(0.0, "N m/rad", "spring from the output shaft to the frame", low=0)
    planets: int = parameter(4, "", "number of planets in the fidelity full", low=1, high=12)
    alpha_0: float = parameter(0.0, "rad", "input angle at t = 0")
    beta_0: float = parameter(0.0, "rad", "output angle at t = 0")
    alpha_rate_0: float = parameter(215.0, "rad/s", "input speed at t = 0")
    beta_rate_0: float = parameter(0.0, "rad/s", "output speed at t = 0")
    motor_torque_0: float = parameter(150.0, "N m", "motor torque at t = 0")

    def __post_init__(self) -> None:
        self.impulse  # noqa: B018 - an impossible transmission raises here

    @cached_property
    def impulse(self) -> Impulse:
        """The same transmission for the closed form; raises MechlabError when there is none."""
        return Impulse(**{f.name: _plain(getattr(self, f.name)) for f in fields(Impulse)})

    @property
    def static_motor(self) -> bool:
        """True when the torque follows the static characteristic."""
        return self.tau < FASTEST_LAG

    @property
    def start(self) -> tuple[float, float, float, float, float]:
        """(alpha, beta, alpha', beta', Md) at t = 0."""
        return self.alpha_0, self.beta_0, self.alpha_rate_0, self.beta_rate_0, self.motor_torque_0


def _plain(x: Any) -> Any:
    return float(x) if isinstance(x, Fraction) else x


def warnings(p: Parameters) -> tuple[str, ...]:
    """Motor constants that contradict each other, a motor that is faster than any step, resonance."""
    out = []
    i = p.impulse
    if p.slip_per_torque is not None and not abs(i.slip / i.consistent_slip - 1.0) <= 0.02:
        no_torque = i.nominal_speed + i.Mn * i.speed_per_torque
        out.append(
            f"the motor constants contradict each other: with slip_per_torque = {i.slip:g} the torque vanishes at "
            f"{no_torque:.4g} rad/s, not at no_load_speed = {p.no_load_speed:g}; slip_per_torque = {i.consistent_slip:.4g} "
            "would fit, or slip_per_torque=none"
        )
    if p.static_motor and p.tau > 0:
        out.append(f"tau = {p.tau:g} s is below {FASTEST_LAG:g} s: the motor torque follows its static characteristic")
    if p.c > 0:
        for m, ratio in enumerate(resonances(i, p.nominal_speed), 1):
            if abs(ratio - 1.0) < 0.1:
                out.append(f"harmonic {m} is near resonance: c = {ratio:.3g} x {m * m} B3 q^2 w^2 at the nominal speed")
    return tuple(out)


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
    b.ground(*frame(p))
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
    """The planets' inertia divided by `share`: mass centre h outwards at psi = 0, moment about the mass centre."""
    mass, moment = p.nm / share, max(0.0, (p.nJ3 - p.nm * p.h**2) / share)
    return Inertia(mass, (p.h, 0.0, 0.0), (0.5 * moment, 0.5 * moment, moment, 0.0, 0.0, 0.0))


def _terms(**coefficients: Fraction) -> Mapping[str, object]:
    return {name: c for name, c in coefficients.items() if c}


def _minimal(b: Builder, p: Parameters) -> None:
    a, other = ratios(p)
    b.body("carrier", revolute("theta"), shapes=carrier(p))
    b.body("planet", revolute("psi"), parent="carrier", at=(p.a + p.b, 0.0, 0.0), inertia=_planet(p, 1))
    b.shaft("alpha", _terms(theta=Fraction(1), psi=other / p.q), inertia=p.J1, shapes=input_shaft(p))
    b.shaft(
        "beta", _terms(theta=Fraction(1), psi=-a / p.q), inertia=p.J2, friction=p.M1, stiffness=p.c,
        shapes=output_shaft(p),
    )  # fmt: skip
    for k in range(p.planets):
        place = planet_placement(p, k)
        b.shaft(f"planet_{k + 1}", {"psi": 1}, body="carrier", placement=place, shapes=planet(p))


def _full(b: Builder, p: Parameters) -> None:
    a, other = ratios(p)
    for body, joint, inertia, shapes in (
        ("input", revolute("alpha"), p.J1, input_shaft(p)),
        ("output", revolute("beta", friction=p.M1, stiffness=p.c), p.J2, output_shaft(p)),
    ):
        # About z only the moment matters; the mass of a shaft is that of a disc of the planets' orbit.
        mass = 2.0 * inertia / (p.a + p.b) ** 2
        b.body(body, joint, inertia=Inertia.axial(mass, inertia, 0.5 * inertia), shapes=shapes)
    b.body("carrier", revolute("theta"), shapes=carrier(p))
    b.relation("carrier_speed", **_terms(theta=Fraction(1), alpha=-a, beta=-other))
    for k in range(p.planets):
        name, place = f"planet_{k + 1}", planet_placement(p, k)
        b.body(
            name, revolute(name), parent="carrier", at=place.position, turned=turn_of(p, k),
            inertia=_planet(p, p.planets), shapes=planet(p),
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
