"""The scenes of the closed differential: constant moments, drags, stops and locks, motors, starts, a torque converter."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from functools import partial
from typing import ClassVar

from mechlab.analytic.differential import Converter
from mechlab.catalog.closed_differential.build import Parameters
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.held_rates import HeldRates, RateHold, ViscousBetween
from mechlab.experiment.laws import Constant, ConstantPower, Law, Motor, Plant, Viscous, register
from mechlab.experiment.scene import Scene, Settings
from mechlab.lazy_dataclass import dataclass

STEP, DRY_STEP = 1e-3, 5e-4
"""Timesteps [s]. Stops, held inputs and locks capture a rate with a time constant of one step; scenes with dry friction
take the finer step, so that the time at which it stops the motion is right."""
MOST_MOTOR_MOMENT = 2000.0
"""Moment [N m] at which a motor of constant power is limited near standstill."""
CHANNELS_SHOWN = ("w_H1", "w_H2", "w1", "w3", "w2", "w5", "angular_momentum", "outer_power")


@register("torque_converter")
@dataclass(frozen=True)
class TorqueConverter:
    """A hydrodynamic converter between two shafts, its reactor on the housing; see `mechlab.analytic.differential.converter`."""

    pump: str
    turbine: str
    converter: Converter
    kind: ClassVar[str]

    def targets(self) -> tuple[str, ...]:
        """The shafts of pump and turbine."""
        return self.pump, self.turbine

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The moments at the present speeds."""
        taken, given = self.converter.moments(plant.rate(self.pump), plant.rate(self.turbine))
        return {self.pump: -taken, self.turbine: given}


def _drags(p: Parameters) -> tuple[Law, ...]:
    pairs = (("block_14", p.drag_14), ("block_36", p.drag_36))
    inner = (ViscousBetween("block_14", "block_36", p.drag_internal),) if p.drag_internal else ()
    return (*(Viscous(on, c) for on, c in pairs if c), *inner)


def _load(p: Parameters) -> Law:
    return Constant("H2", -p.M_H2)


def _constant(p: Parameters) -> tuple[Law, ...]:
    return Constant("H1", p.M_H1), _load(p), *_drags(p)


def _motor(p: Parameters, motor: Law) -> tuple[Law, ...]:
    return motor, Viscous("H2", p.load_drag), *_drags(p)


def _input(p: Parameters) -> RateHold:
    return RateHold("H1", p.w_H1_0)


STOP = RateHold("block_36", 0.0, low=0.0)


def _friction(on: str, moment: float) -> RateHold:
    return RateHold(on, 0.0, -abs(moment), abs(moment))


def _dry_load(p: Parameters) -> tuple[Law, ...]:
    return (HeldRates((_input(p), _friction("H2", p.M_H2)), _drags(p), DRY_STEP),)


def _dry_start(p: Parameters, *brakes: RateHold) -> tuple[Law, ...]:
    return (HeldRates((_friction("H2", p.M_H2), *brakes), (Constant("H1", p.M_H1), *_drags(p)), DRY_STEP),)


def _with_converter(p: Parameters, lossless: bool) -> tuple[Law, ...]:
    return *_constant(p), TorqueConverter("block_14", "H2", p.converter(lossless))


def _locked(p: Parameters) -> tuple[Law, ...]:
    pair = RateHold((("block_14", 1.0), ("block_36", -float(p.lock_ratio))))
    return (HeldRates((pair,), _constant(p), STEP),)


REST = {"w_H1_0": 0.0, "w_H2_0": 0.0}


@dataclass(frozen=True)
class Case:
    """A scene: its text, duration [s], laws for some parameters, and its own defaults of parameters."""

    text: str
    duration: float
    laws: Callable[[Parameters], tuple[Law, ...]]
    overrides: Mapping[str, float] = field(default_factory=dict)


CASES = {
    "constant-moments": Case("M_H1 drives, M_H2 resists, nothing else: (8) holds at one instant", 0.5, _constant),
    "held-input-dry-load": Case(
        "a servo holds w_H1 at w_H1_0, dry friction of M_H2 loads the output: it stops and sticks", 1.0, _dry_load,
    ),
    "housing-drag": Case(
        "constant moments, both blocks drag on the housing", 20.0, _constant, {"drag_14": 0.02, "drag_36": 2.0},
    ),
    "internal-drag": Case(
        "constant moments, viscous drag between the blocks only: the train runs backwards", 2.0, _constant,
        {"drag_internal": 0.5},
    ),
    "one-way-stop": Case(
        "constant moments from rest, block 36 cannot turn backwards: an ordinary gear of ratio a/b", 1.0,
        lambda p: (HeldRates((STOP,), _constant(p), STEP),), {"w_H1_0": 0.0, "w_H2_0": 0.0},
    ),
    "locked-pair": Case("constant moments, w1 = lock_ratio w3 held: an ordinary gear of one freedom", 1.0, _locked),
    "motor-and-viscous-load": Case(
        "a motor with a straight characteristic, a viscous load: the output comes to rest", 10.0,
        lambda p: _motor(p, Motor("H1", p.motor_stall, p.motor_no_load)),
    ),
    "constant-power": Case(
        "a motor of constant power, a viscous load: the input runs away, the output comes to rest", 60.0,
        lambda p: _motor(p, ConstantPower("H1", p.motor_power, MOST_MOTOR_MOMENT)),
    ),
    "backstop-two-range": Case(
        "input held, one-way stop of block 36, drag between the blocks: two ranges, with losses", 10.0,
        lambda p: (HeldRates((_input(p), STOP), (_load(p), *_drags(p)), STEP),), {"drag_internal": 0.2},
    ),
    "dry-start": Case(
        "M_H1 alone, from rest, against dry friction of M_H2: the output never starts, the input runs away", 1.0, _dry_start, REST,
    ),
    "braked-start": Case(
        "the same with a brake on block 36: an ordinary gear of ratio a/b, the output starts", 1.0,
        lambda p: _dry_start(p, _friction("block_36", p.brake_moment)), REST,
    ),
    "brake-released": Case(
        "M_H1 against dry friction after a braked start, without the brake: the output stops again", 1.0, _dry_start,
        {"w_H2_0": 25.0},
    ),
    "torque-converter": Case(
        "constant moments and the converter of the source's figure 1, pump on block 14, turbine on H2: one steady state", 5.0,
        lambda p: _with_converter(p, False),
    ),
    "lossless-converter": Case(
        "the same with a converter without losses: M_H1 w_H1 comes to M_H2 w_H2, the law (10)", 5.0,
        lambda p: _with_converter(p, True),
    ),
}  # fmt: skip


SLIPPING = ("constant-power", "backstop-two-range")
"""In these long scenes the slips of MuJoCo's soft rows add up, to 3e-4 rad of 1,000 and more."""


def _scene(name: str, p: Parameters, fidelity: str) -> Scene:
    case = CASES[name]
    laws = case.laws(p)
    dry = case.laws is not _locked and isinstance(laws[0], HeldRates) and laws[0].time == DRY_STEP
    slips = fidelity != "minimal" and name in SLIPPING
    # the capture of held rates is of first order in its time: it leaves up to 4e-4 rad of some 200
    tolerance = 1e-3 if dry or slips else 1e-4 if isinstance(laws[0], HeldRates) else 1e-5
    return Scene(
        name, fidelity, case.duration, laws, initial_rates={"H1": p.w_H1_0, "H2": p.w_H2_0}, channels=CHANNELS_SHOWN,
        needs=("poses", "drive_forces"), tolerance=tolerance, settings=Settings(timestep=DRY_STEP if dry else STEP),
        text=case.text,
    )  # fmt: skip


SCENES = {n: SceneRecipe(partial(_scene, n), "minimal", c.text, c.overrides) for n, c in CASES.items()}
