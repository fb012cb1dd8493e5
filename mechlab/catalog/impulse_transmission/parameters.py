"""Parameters of the inertial-impulse transmission."""

from __future__ import annotations

from dataclasses import dataclass, fields
from fractions import Fraction
from functools import cached_property
from typing import Any

from mechlab.analytic.impulse import Impulse, resonances
from mechlab.experiment.parameters import parameter

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
