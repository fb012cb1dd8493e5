"""The inertial-impulse transmission: parameters, and the Mechanism with two coordinates, or with every part a body.

The source prints no drawing to scale: the radii of the shapes follow the inertias and the offset h.
"""

from __future__ import annotations

import math
from dataclasses import fields
from fractions import Fraction
from functools import cached_property, lru_cache

import numpy as np

from mechlab.analytic.impulse import Impulse, resonances
from mechlab.catalog.bibliography import ALYUKOV
from mechlab.errors import unknown
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.kit.palette import BLUE, BRASS, DARK, RED, STEEL
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, as_fraction, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.parts import Color, Shape, Winding

NAME = "impulse_transmission"
OURS = "ours; the scenes fig2 to fig7 have the printed states"
FIGURES_4_5 = f"{ALYUKOV.label}, figures 4 and 5"
FIGURE_4 = f"{ALYUKOV.label}, figure 4"
FASTEST_LAG = 2e-5
"""Below this motor time constant [s] the torque follows the static characteristic: its lag is shorter than any step."""


@dataclass(frozen=True)
class Parameters:
    """Inertias, geometry, load, motor, and the state at t = 0."""

    J1: float = parameter(14.0, "kg m2", "input shaft", source=FIGURES_4_5, low=0, strict=True)
    J2: float = parameter(0.5, "kg m2", "output shaft", source=FIGURES_4_5, low=0, strict=True)
    nJ3: float = parameter(
        0.25, "kg m2", "all planets, about their geometric centres", source=FIGURES_4_5, low=0, strict=True
    )
    nm: float = parameter(8.0, "kg", "mass of all planets", source=FIGURES_4_5, low=0, strict=True)
    a: float = parameter(0.02, "m", "share of the input speed in the planet centres' speed", source=FIGURES_4_5)
    b: float = parameter(0.08, "m", "share of the output speed; a + b is the radius of the planet axes", source=FIGURES_4_5)
    h: float = parameter(0.083, "m", "offset of a planet's mass centre from its axis", source=FIGURES_4_5, low=0)
    q: Fraction = parameter(Fraction(4, 3), "", "turns of a planet on the carrier per turn of input against output")
    M0: float = parameter(18.0, "N m", "constant load on the output shaft", source=FIGURE_4, low=0)
    M1: float = parameter(750.0, "N m", "dry friction on the output shaft", source=FIGURE_4, low=0)
    Mn: float = parameter(150.0, "N m", "motor torque at the nominal speed", source=FIGURE_4)
    no_load_speed: float = parameter(220.0, "rad/s", "motor speed without torque", source=FIGURE_4)
    nominal_speed: float = parameter(215.0, "rad/s", "motor speed at the torque Mn", source=FIGURE_4)
    tau: float = parameter(0.038, "s", "time constant of the motor torque; 0: static", source=FIGURES_4_5, low=0)
    slip_per_torque: float | None = parameter(
        None, "1/(N m)", "relative loss of speed per torque; none: the value that gives no torque at no_load_speed", low=0
    )  # fmt: skip
    c: float = parameter(0.0, "N m/rad", "spring from the output shaft to the frame", low=0)
    planets: int = parameter(4, "", "number of planets in the fidelity full", low=1, high=12)
    alpha_0: float = parameter(0.0, "rad", "input angle at t = 0", source=OURS)
    beta_0: float = parameter(0.0, "rad", "output angle at t = 0", source=OURS)
    alpha_rate_0: float = parameter(215.0, "rad/s", "input speed at t = 0", source=OURS)
    beta_rate_0: float = parameter(0.0, "rad/s", "output speed at t = 0", source=OURS)
    motor_torque_0: float = parameter(150.0, "N m", "motor torque at t = 0", source=OURS)

    def __post_init__(self) -> None:
        self.impulse  # noqa: B018 - an impossible transmission raises here

    @cached_property
    def impulse(self) -> Impulse:
        """The same transmission for the closed form; raises MechlabError when there is none."""
        same = {f.name: getattr(self, f.name) for f in fields(Impulse)}
        return Impulse(**same | {"q": float(self.q)})

    @property
    def static_motor(self) -> bool:
        """True when the torque follows the static characteristic."""
        return self.tau < FASTEST_LAG

    @property
    def start(self) -> tuple[float, float, float, float, float]:
        """(alpha, beta, alpha', beta', Md) at t = 0."""
        return self.alpha_0, self.beta_0, self.alpha_rate_0, self.beta_rate_0, self.motor_torque_0

    @property
    def orbit(self) -> float:
        """Radius of the planet axes [m]."""
        return self.a + self.b

    @property
    def ratios(self) -> tuple[Fraction, Fraction]:
        """a / (a + b) and b / (a + b), exactly from the decimals as written."""
        a, b = as_fraction(self.a, "a"), as_fraction(self.b, "b")
        return a / (a + b), b / (a + b)

    @property
    def winding(self) -> Winding:
        """The motor as a DC motor of torque constant 1: its current is the torque, resistance nu wxx, inductance tau nu wxx."""
        resistance = self.impulse.speed_per_torque
        return Winding(1.0, resistance, 0.0 if self.static_motor else self.tau * resistance)

    @property
    def voltage(self) -> float:
        """Voltage of that DC motor at which the torque is Mn at the nominal speed."""
        return self.nominal_speed + self.impulse.speed_per_torque * self.Mn


def warnings(p: Parameters) -> tuple[str, ...]:
    """Motor constants that contradict each other, a motor that is faster than any step, resonance."""
    out = []
    i = p.impulse
    if p.slip_per_torque is not None and not abs(i.slip / i.consistent_slip - 1.0) <= 0.02:
        out.append(
            f"the motor constants contradict each other: with slip_per_torque = {i.slip:g} the torque vanishes at "
            f"{p.voltage:.4g} rad/s, not at no_load_speed = {p.no_load_speed:g}; slip_per_torque = {i.consistent_slip:.4g} "
            "would fit, or slip_per_torque=none"
        )
    if p.static_motor and p.tau > 0:
        out.append(f"tau = {p.tau:g} s is below {FASTEST_LAG:g} s: the motor torque follows its static characteristic")
    near = [(m, x) for m, x in enumerate(resonances(i, p.nominal_speed), 1) if p.c > 0 and abs(x - 1.0) < 0.1]
    out += [f"harmonic {m} is near resonance: c = {x:.3g} x {m * m} B3 q^2 w^2 at the nominal speed" for m, x in near]
    return tuple(out)


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
    k = p.orbit
    for z, name in ((-1.2 * k, "bearing_1"), (1.2 * k, "bearing_2")):
        b.ground(shape("tube", Placement((0.0, 0.0, z)), DARK, name, outer=0.22 * k, inner=0.14 * k, length=0.15 * k))
    b.drive("alpha", winding=p.winding)
    return b.build()


def _minimal(b: Builder, p: Parameters) -> None:
    a, other = p.ratios
    b.body("carrier", revolute("theta"), shapes=_carrier(p))
    b.body("planet", revolute("psi"), parent="carrier", at=(p.orbit, 0.0, 0.0), inertia=_planet_inertia(p, 1))
    b.shaft("alpha", _nonzero({"theta": Fraction(1), "psi": other / p.q}), inertia=p.J1, shapes=_shaft(p, "input"))
    b.shaft("beta", _nonzero({"theta": Fraction(1), "psi": -a / p.q}), inertia=p.J2, friction=p.M1, stiffness=p.c,
            shapes=_shaft(p, "output"))  # fmt: skip
    for k in range(p.planets):
        place = _about_z(_ray(p, k), _on_orbit(p, k))
        b.shaft(f"planet_{k + 1}", {"psi": 1}, body="carrier", placement=place, shapes=_planet(p))


def _full(b: Builder, p: Parameters) -> None:
    a, other = p.ratios
    for body, joint, moment in (
        ("input", revolute("alpha"), p.J1),
        ("output", revolute("beta", friction=p.M1, stiffness=p.c), p.J2),
    ):
        # About z only the moment matters; the mass of a shaft is that of a disc of the planets' orbit.
        inertia = Inertia.axial(2.0 * moment / p.orbit**2, moment, 0.5 * moment)
        b.body(body, joint, inertia=inertia, shapes=_shaft(p, body))
    b.body("carrier", revolute("theta"), shapes=_carrier(p))
    b.relation("carrier_speed", **_nonzero({"theta": Fraction(1), "alpha": -a, "beta": -other}))
    for k in range(p.planets):
        name = f"planet_{k + 1}"
        b.body(name, revolute(name), parent="carrier", at=_on_orbit(p, k), turned=_about_z(_ray(p, k)),
               inertia=_planet_inertia(p, p.planets), shapes=_planet(p))  # fmt: skip
        b.relation(f"{name}_turn", **{name: Fraction(1), "alpha": -p.q, "beta": p.q})


def _planet_inertia(p: Parameters, share: int) -> Inertia:
    """The planets' inertia divided by `share`: mass centre h outwards at psi = 0, moment about the mass centre."""
    mass, moment = p.nm / share, max(0.0, (p.nJ3 - p.nm * p.h**2) / share)
    return Inertia(mass, (p.h, 0.0, 0.0), (0.5 * moment, 0.5 * moment, moment, 0.0, 0.0, 0.0))


def _nonzero(terms: dict[str, Fraction]) -> dict[str, object]:
    return {name: c for name, c in terms.items() if c}


def _ray(p: Parameters, k: int) -> float:
    """Angle [rad] of the axis of planet k on the carrier; its mass centre lies outwards at psi = 0."""
    return 2.0 * math.pi * k / p.planets


def _on_orbit(p: Parameters, k: int, z: float = 0.0) -> tuple[float, float, float]:
    return p.orbit * math.cos(_ray(p, k)), p.orbit * math.sin(_ray(p, k)), z


def _about_z(angle: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Placement:
    return Placement.of(axis_rotation((0.0, 0.0, 1.0), angle), at)


def _planet(p: Parameters) -> tuple[Shape, ...]:
    """A planet wheel as large as its neighbours allow, with its eccentric weight drawn inside the wheel."""
    room = p.orbit * (math.sin(math.pi / p.planets) if p.planets > 1 else 1.0)
    r, w = 0.9 * min(room, 0.7 * p.orbit), 0.25 * p.orbit
    off = Placement((min(p.h, 0.55 * r), 0.0, 0.0))
    return (
        shape("disc", color=STEEL, name="planet", radius=r, thickness=w, bore=0.12 * r),
        shape("cylinder", off, BRASS, "weight", radius=0.32 * r, length=1.5 * w),
    )


def _carrier(p: Parameters) -> tuple[Shape, ...]:
    """Hub and one arm and pin for each planet, behind the planets."""
    k, w = p.orbit, 0.25 * p.orbit
    out = [shape("disc", Placement((0.0, 0.0, -w)), RED, "hub", radius=0.25 * k, thickness=0.4 * w)]
    size = {"length": k, "width": 0.2 * k, "thickness": 0.4 * w, "bore": 0.04 * k}
    for i in range(p.planets):
        pin = Placement(_on_orbit(p, i, -0.3 * w))
        out.append(shape("link", _about_z(_ray(p, i), (0.0, 0.0, -w)), RED, f"arm_{i + 1}", **size))
        out.append(shape("cylinder", pin, DARK, f"pin_{i + 1}", radius=0.04 * k, length=2.2 * w))
    return tuple(out)


def _shaft(p: Parameters, name: str) -> tuple[Shape, ...]:
    """The input shaft behind or the output shaft in front, with a flywheel and a mark that shows its turn."""
    side, color = SIDES[name]
    k = p.orbit
    middle, end, mark = ((x, 0.0, z * side * k) for x, z in ((0.0, 0.6), (0.0, 0.9), (0.36 * k, 0.68)))
    return (
        shape("disc", Placement(middle), color, name, radius=0.5 * k, thickness=0.15 * k, bore=0.05 * k),
        shape("cylinder", Placement(end), color, "shaft", radius=0.12 * k, length=0.9 * k),
        shape("box", Placement(mark), DARK, "mark", x=0.2 * k, y=0.05 * k, z=0.04 * k),
    )


SIDES: dict[str, tuple[float, Color]] = {"input": (-1.0, BLUE), "output": (1.0, BRASS)}


def coordinates(p: Parameters, fidelity: str, alpha: Array, beta: Array) -> Array:
    """(n, nq) coordinates of a fidelity from both shaft angles (n,); its rates from both speeds."""
    a, other = (float(x) for x in p.ratios)
    psi = float(p.q) * (alpha - beta)
    values = {"alpha": alpha, "beta": beta, "theta": a * alpha + other * beta}
    return np.column_stack([values.get(j.name, psi) for j in build(p, fidelity).joints])


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """Every planet along a recording of any fidelity."""
    if recording.fidelity == "full":
        return build(p, "full"), recording.q
    return build(p, "full"), coordinates(p, "full", recording.channel("alpha"), recording.channel("beta"))
