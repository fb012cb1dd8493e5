"""Scenes of the closed differential: what is tried with it in and around the source's claim."""

from __future__ import annotations

from functools import partial

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.parameters import Parameters
from mechlab.catalog.closed_differential.witnesses import SPEEDS
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.held_rates import HeldRates, RateHold, ViscousBetween
from mechlab.experiment.laws import Constant, ConstantPower, Law, Motor, Viscous
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism.geometry import Array

STEP, DRY_STEP = 1e-3, 5e-4
"""Timesteps [s]; stops, held inputs and locks catch a rate with a time constant of one step, dry friction of a finer one
so that the time of its stop is right."""
MOST_MOTOR_MOMENT = 2000.0
"""Moment [N m] at which a motor of constant power is limited near standstill."""
CHANNELS_SHOWN = ("w_H1", "w_H2", "w1", "w3", "w2", "w5", "angular_momentum", "outer_power")


def _drags(p: Parameters) -> tuple[Law, ...]:
    pairs = (("block_14", p.drag_14), ("block_36", p.drag_36))
    inner = (ViscousBetween("block_14", "block_36", p.drag_internal),) if p.drag_internal else ()
    return (*(Viscous(on, c) for on, c in pairs if c), *inner)


def _moments(p: Parameters) -> tuple[Law, ...]:
    return Constant("H1", p.M_H1), Constant("H2", -p.M_H2)


def _laws(name: str, p: Parameters) -> tuple[Law, ...]:
    stop = RateHold("block_36", 0.0, low=0.0)
    held = RateHold("H1", p.w_H1_0)
    locked = RateHold((("block_14", 1.0), ("block_36", -float(p.lock_ratio))))
    dry = RateHold("H2", 0.0, -abs(p.M_H2), abs(p.M_H2))
    drags, load = _drags(p), Constant("H2", -p.M_H2)
    if name == "held-input-dry-load":
        return (HeldRates((held, dry), drags, DRY_STEP),)
    if name == "one-way-stop":
        return (HeldRates((stop,), (*_moments(p), *drags), STEP),)
    if name == "locked-pair":
        return (HeldRates((locked,), (*_moments(p), *drags), STEP),)
    if name == "backstop-two-range":
        return (HeldRates((held, stop), (load, *drags), STEP),)
    if name == "motor-and-viscous-load":
        return (Motor("H1", p.motor_stall, p.motor_no_load), Viscous("H2", p.load_drag), *drags)
    if name == "constant-power":
        return (ConstantPower("H1", p.motor_power, MOST_MOTOR_MOMENT), Viscous("H2", p.load_drag), *drags)
    return (*_moments(p), *drags)


def make(name: str, duration: float, p: Parameters, fidelity: str) -> Scene:
    """The scene of that name."""
    laws = _laws(name, p)
    dry = name == "held-input-dry-load"
    # the capture of held rates is of first order in its time: it leaves up to 4e-4 rad of some 200
    tolerance = 1e-3 if dry else 1e-4 if isinstance(laws[0], HeldRates) else 1e-5
    step = DRY_STEP if dry else STEP
    return Scene(
        name, fidelity, duration, laws, initial_rates={"H1": p.w_H1_0, "H2": p.w_H2_0}, channels=CHANNELS_SHOWN,
        needs=("poses", "drive_forces"), tolerance=tolerance, settings=Settings(timestep=step), text=TEXTS[name],
    )  # fmt: skip


TEXTS = {
    "constant-moments": "M_H1 drives, M_H2 resists, nothing else: (8) holds at one instant",
    "held-input-dry-load": "a servo holds w_H1 at w_H1_0, dry friction of M_H2 loads the output: it stops and sticks",
    "housing-drag": "constant moments, both blocks drag on the housing",
    "internal-drag": "constant moments, viscous drag between the blocks only: the train runs backwards",
    "one-way-stop": "constant moments from rest, block 36 cannot turn backwards: an ordinary gear of ratio a/b",
    "locked-pair": "constant moments, w1 = lock_ratio w3 held: an ordinary gear of one freedom",
    "motor-and-viscous-load": "a motor with a straight characteristic, a viscous load: the output comes to rest",
    "constant-power": "a motor of constant power, a viscous load: the input runs away, the output comes to rest",
    "backstop-two-range": "input held, one-way stop of block 36, drag between the blocks: two ranges, with losses",
}
_DURATIONS = (0.5, 1.0, 20.0, 2.0, 1.0, 1.0, 10.0, 60.0, 10.0)
_OVERRIDES: dict[str, dict[str, float]] = {
    "housing-drag": {"drag_14": 0.02, "drag_36": 2.0},
    "internal-drag": {"drag_internal": 0.5},
    "one-way-stop": {"w_H1_0": 0.0, "w_H2_0": 0.0},
    "backstop-two-range": {"drag_internal": 0.2},
}
SCENES = {
    name: SceneRecipe(partial(make, name, duration), "minimal", text, _OVERRIDES.get(name, {}))
    for (name, text), duration in zip(TEXTS.items(), _DURATIONS, strict=True)
}


def _speed(name: str, p: Parameters, recording: Recording) -> Array:
    return recording.channel(f"{SPEEDS[name]}_rate")


def _momentum(p: Parameters, recording: Recording) -> Array:
    """Angular momentum about the axis: its rate is the sum of all moments from outside."""
    row = closed.momentum_row(p.train, p.inertias)
    return row[0] * recording.channel("block_14_rate") + row[1] * recording.channel("block_36_rate")


def _power(p: Parameters, recording: Recording) -> Array:
    """Power of the moments on both carriers; zero where (8) holds."""
    return sum(
        (recording.channel(f"{n}_force") * recording.channel(f"{n}_rate") for n in ("H1", "H2")), 0.0 * recording.t
    )


CHANNELS = {name: ("rad/s", partial(_speed, name)) for name in SPEEDS} | {
    "angular_momentum": ("N m s", _momentum),
    "outer_power": ("W", _power),
}
