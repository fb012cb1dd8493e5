"""The question of free motion: joint accelerations of the leg in any state, from each witness."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.analytic import transition_matrices as tm
from mechlab.catalog.prosthetic_leg.build import LEG, build, tree
from mechlab.catalog.prosthetic_leg.parameters import Parameters
from mechlab.engines.protocol import engine
from mechlab.experiment.question import Answer, Question, with_rates
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

Terms = tuple[Array, Array, Array]


def own_terms(t: tm.Tree, q: Array, v: Array) -> Terms:
    """M, h and qdd (h with weight, springs and dampers: M qdd + h = 0) from the transition matrices."""
    h = tm.bias_force(t, q, v) - tm.gravity_force(t, q) - tm.elastic_force(t, q, v)
    return tm.mass_matrix(t, q), h, tm.accelerations(t, q, v)


def engine_terms(name: str, m: Mechanism, q: Array, v: Array) -> Terms:
    """The same from an engine: Pinocchio's crba, rnea and aba; MuJoCo's full M, qfrc_bias - qfrc_passive and qacc."""
    state = engine(name).state(m, q, v)
    return state.mass_matrix, state.bias, engine(name).accelerations(m, q, v)


def _values(qdd: Array) -> dict[str, float]:
    return {f"{n}_accel": float(x) for n, x in zip(LEG, qdd, strict=True)}


def _state(given: Mapping[str, Any]) -> tuple[Array, Array]:
    return np.array([float(given[n]) for n in LEG]), np.array([float(given[f"{n}_rate"]) for n in LEG])


def _analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    return Answer(_values(own_terms(tree(p), *_state(given))[2]))


def _pinocchio(p: Parameters, given: Mapping[str, Any]) -> Answer:
    return Answer(_values(engine_terms("pinocchio", build(p, "parts"), *_state(given))[2]))


def _mujoco(p: Parameters, given: Mapping[str, Any]) -> Answer:
    return Answer(_values(engine_terms("mujoco", build(p, "parts"), *_state(given))[2]))


OTHERS = [n for n in (*LEG, *(f"{n}_rate" for n in LEG)) if n not in ("hip", "knee")]
QUESTION = Question(
    "free motion",
    given=("hip", "knee"),
    optional=dict.fromkeys(OTHERS, 0.0),
    answers=tuple(f"{n}_accel" for n in LEG),
    witnesses={"analytic": _analytic, "pinocchio": _pinocchio, "mujoco": _mujoco},
    units=with_rates({n: "m" if n in ("hitch", "thigh", "shin") else "rad" for n in LEG}),
    text="accelerations of the passive leg of six freedoms in a state, trunk fixed",
)


def random_states(count: int, joints: int, seed: int = 4) -> tuple[Array, Array]:
    """q, v (count, joints): slides and turns of a tenth to a half, rates of a few per second."""
    rng = np.random.default_rng(seed)
    return 0.5 * rng.standard_normal((count, joints)), 3.0 * rng.standard_normal((count, joints))
