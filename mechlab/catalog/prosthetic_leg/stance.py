"""The straight leg in stance: springs fitted to a stated stiffness, its rest on the floor by statics, and by the equations of the engines.

Rails hold the trunk upright and over the leg, stiff servos hold hip and knee. Hitch, thigh and shin then stand in series: the leg from hip
to ankle has the stiffness 1 / (1/C_hitch + 1/C_thigh + 1/C_shin).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any

import numpy as np

from mechlab.catalog.prosthetic_leg.build import (
    FLOOR_STIFFNESS,
    FREE,
    HEEL,
    HELD,
    Parameters,
    body,
    build,
    hip_height,
    standing,
)
from mechlab.engines.protocol import engine
from mechlab.errors import NoSolution
from mechlab.experiment.question import Answer, Question
from mechlab.kit.questions import for_engines
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.newton import Status

JOINTS = ("trunk_z", "hitch", "thigh", "shin", "ankle")
BUCKLES = "the straight leg does not bear this load: it buckles at hip and knee, whose locks give way"
ANSWERS = (*JOINTS, "leg_stiffness", "stiffness_on_floor")
LARGEST_TURN = 0.5
"""Turn of the foot up to which its rest is looked for [rad]."""
PROBE = 1.0
"""Additional load by which a stiffness is found [N]."""


def statics(p: Parameters, load: float) -> dict[str, float]:
    """Joints at rest under the weight of the body and `load` [N] on the trunk.

    Each slide carries what is above it. The foot turns by theta about the ankle until heel and toe, each a spring of FLOOR_STIFFNESS
    where it is below the floor, balance its weight and the spring of the ankle, behind which the leg leans a little. Raises NoSolution
    where the leg would be torn off the floor, where it buckles, or where a spring is missing.
    """
    from scipy.optimize import brentq

    b, g = body(p), p.gravity
    _stands(p, load)
    springs = p.fitted_springs
    above = load + g * np.array([
        b.trunk.mass, b.trunk.mass + b.hitch_mass + 0.5 * b.thigh.mass,
        b.trunk.mass + b.hitch_mass + b.thigh.mass + 0.5 * b.shin.mass,
    ])  # fmt: skip
    hitch, thigh, shin = above / springs
    on_ankle = float(above[2]) + 0.5 * b.shin.mass * g
    total = on_ankle + b.foot.mass * g
    stiffness = p.ankle_stiffness / (1.0 + p.ankle_stiffness * _lean(p, on_ankle, float(thigh), float(shin)))

    def contact(theta: float) -> tuple[float, float]:
        """Moment on the foot about the ankle, and the ankle's height, with the foot turned by theta and the vertical forces balanced."""
        c, s = math.cos(theta), math.sin(theta)
        x, z = (np.array([-HEEL, b.foot.length - HEEL]) * k for k in (c, s))
        x, z = x + b.sole * s, z - b.sole * c
        both = -(total / FLOOR_STIFFNESS + float(z.sum())) / 2.0
        height = both if both <= -float(z.max()) else -total / FLOOR_STIFFNESS - float(z.min())
        forces = FLOOR_STIFFNESS * np.maximum(0.0, -(height + z))
        weight = b.foot.mass * g * (b.foot_forward * c + b.foot_drop * s)
        return float(forces @ x) - weight - stiffness * theta, height

    if contact(-LARGEST_TURN)[0] * contact(LARGEST_TURN)[0] > 0.0:
        raise NoSolution(f"prosthetic_leg: under a load of {load:g} N the foot turns by more than {LARGEST_TURN:g} rad.")
    theta = float(brentq(lambda x: contact(x)[0], -LARGEST_TURN, LARGEST_TURN, xtol=1e-15))
    straight = hip_height(p) - b.sole
    trunk = contact(theta)[1] - hitch + straight - thigh - shin - hip_height(p)
    return {"trunk_z": trunk, "hitch": hitch, "thigh": -thigh, "shin": -shin, "ankle": theta * stiffness / p.ankle_stiffness
            if p.ankle_stiffness > 0.0 else theta}  # fmt: skip


def _stands(p: Parameters, load: float) -> None:
    """Raises NoSolution unless the leg can rest on the floor."""
    b = body(p)
    if min(p.fitted_springs) <= 0.0:
        raise NoSolution("prosthetic_leg: a slide without a spring carries no weight; give C_hitch, C_thigh and C_shin above 0.")
    weight = p.gravity * (b.trunk.mass + b.hitch_mass + b.thigh.mass + b.shin.mass + b.foot.mass)
    if weight + load <= 0.0:
        raise NoSolution(f"prosthetic_leg: nothing presses the foot on the floor: weight {weight:.6g} N, load {load:g} N.")


def _lean(p: Parameters, on_ankle: float, thigh_sinks: float, shin_sinks: float) -> float:
    """Turn of the shin per moment that the ankle's spring puts on it [rad/(N m)], to first order in the small turns of trunk, hip and
    knee: their locks against that moment, and against the weight that the leaning leg carries (`on_ankle` [N] at its end). Thigh and shin
    are shorter by what their slides sink [m]. Raises NoSolution where the weight buckles the leg in spite of its locks and of the ankle."""
    b, g = body(p), p.gravity
    k_hip, k_knee, k_trunk = (HELD[n][0] for n in ("hip", "knee", "trunk"))
    shin = on_ankle * (b.shin.length - shin_sinks) - b.shin.mass * g * b.shin.com
    thigh = (on_ankle - b.shin.mass * g) * (b.thigh.length - thigh_sinks) - b.thigh.mass * g * b.thigh.com
    rows = np.array([  # trunk, hip, knee: lock, less the weight on what leans
        [k_trunk - b.trunk.mass * g * b.trunk.com - thigh - shin, -thigh - shin, -shin],
        [-thigh - shin, k_hip - thigh - shin, -shin],
        [-shin, -shin, k_knee - shin],
    ])  # fmt: skip
    if np.linalg.eigvalsh(rows + p.ankle_stiffness)[0] <= 0.0:  # the ankle's spring feels the sum of the three
        raise NoSolution(f"prosthetic_leg: {BUCKLES}.")
    return float(np.linalg.solve(rows, np.ones(3)).sum())


def at_rest(name: str, p: Parameters, load: float) -> tuple[dict[str, float], float]:
    """Joints of the whole leg at rest, and the height of the hip over the ankle [m], by Newton on an engine's own equations."""
    _stands(p, load)
    m = build(p, "full")
    plant = engine(name).plant(m)
    laws = standing(p, "full", -hip_height(p))
    n = len(FREE["full"])

    def residual(q: Array) -> Array:
        plant.set(q, np.zeros(n))
        force = np.zeros(n)
        force[m.v_slice["trunk_z"].start] -= load
        for law in laws:
            for joint, value in law.force(0.0, plant).items():
                force[m.v_slice[joint].start] += value
        return np.asarray(plant.bias() - force)

    q = np.zeros(n)
    q[m.q_slice["trunk_z"].start] = -0.01  # heel and toe are below the floor
    step = 1e-7
    for _ in range(30):
        r = residual(q)
        slopes = np.column_stack([(residual(q + step * e) - residual(q - step * e)) / (2.0 * step) for e in np.eye(n)])
        try:
            change = np.linalg.solve(slopes, -r)
        except np.linalg.LinAlgError:
            raise NoSolution(f"prosthetic_leg: {name} finds no rest under a load of {load:g} N: the foot has lost the floor.") from None
        q = q + change * min(1.0, 0.1 / max(float(np.abs(change).max()), 1e-300))
        if np.abs(change).max() < 1e-12:
            break
    else:
        raise NoSolution(f"prosthetic_leg: {name} finds no rest of the leg under a load of {load:g} N.")
    if np.linalg.eigvalsh(0.5 * (slopes + slopes.T))[0] <= 0.0:
        raise NoSolution(f"prosthetic_leg: {BUCKLES}.")
    plant.set(q, np.zeros(n))
    joints = {j: float(q[m.q_slice[j].start]) for j in FREE["full"]}
    return joints, joints["trunk_z"] - float(plant.point("ankle_point")[2])


def _stiffnesses(name: str, p: Parameters, load: float) -> dict[str, float]:
    """Stiffness of the leg hip to ankle, and with the floor, by a small additional load."""
    (low, short), (high, shorter) = (at_rest(name, p, load + x) for x in (-0.5 * PROBE, 0.5 * PROBE))
    return {"leg_stiffness": PROBE / (short - shorter), "stiffness_on_floor": PROBE / (low["trunk_z"] - high["trunk_z"])}


def _analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    load = float(given["stance_load"])
    low, high = (statics(p, load + x)["trunk_z"] for x in (-0.5 * PROBE, 0.5 * PROBE))
    series = 1.0 / sum(1.0 / c for c in p.fitted_springs)
    note = "springs of hitch, thigh and shin: " + ", ".join(f"{c:.6g}" for c in p.fitted_springs) + " N/m"
    return Answer(statics(p, load) | {"leg_stiffness": series, "stiffness_on_floor": PROBE / (low - high)}, notes=(note,))


def _engine(name: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    load = float(given["stance_load"])
    joints, _ = at_rest(name, p, load)
    return Answer({n: joints[n] for n in JOINTS} | _stiffnesses(name, p, load))


def _asked(ask: Callable[..., Answer]) -> Callable[..., Answer]:
    """`ask` with NoSolution as its answer."""

    @wraps(ask)
    def witness(*known: Any) -> Answer:
        try:
            return ask(*known)
        except NoSolution as never:
            return Answer(status=Status.NO_REGIME, notes=(str(never).removeprefix("prosthetic_leg: ").removesuffix("."),))

    return witness


STANCE = Question(
    "rest of the leg in stance",
    given=("stance_load",),
    answers=ANSWERS,
    witnesses={"analytic": _asked(_analytic)} | for_engines(_asked(_engine)),
    tolerance=2e-5,  # the closed form is of first order in the lean of the leg: 4e-7 of the ankle's turn with 300 N, 9e-6 with 2000 N
    units={"stance_load": "N", "ankle": "rad", "leg_stiffness": "N/m", "stiffness_on_floor": "N/m"} | dict.fromkeys(JOINTS[:4], "m"),
    text="joints of the straight leg at rest on the floor, a load on the trunk besides the weight of the body; its stiffness from hip to "
    "ankle, and with the floor",
)  # fmt: skip
