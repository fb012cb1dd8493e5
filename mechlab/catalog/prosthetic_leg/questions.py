"""The leg's own equations in transition matrices, and its questions: joint accelerations in any state, and which slides a
swing needs. The second compares the path of the ankle with some joints locked to the path with all of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic import transition_matrices as tm
from mechlab.catalog.prosthetic_leg.build import (
    FREE,
    LEG,
    SWING_RATES,
    SWING_START,
    TRUNK,
    Parameters,
    body,
    build,
    mechanism,
)
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.question import Answer, Question, with_rates
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene, Settings
from mechlab.integrate import integrate_adaptive
from mechlab.kit.questions import for_engines
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

Terms = tuple[Array, Array, Array]


def tree(p: Parameters, free: tuple[str, ...] = LEG) -> tm.Tree:
    """The same leg in planar transition matrices: x forwards, y up; thigh x down. Joints not in `free` are held at zero.

    Its coordinates are the joints in `free`, in the order trunk_x trunk_z trunk hitch hip thigh knee shin ankle.
    """
    b = body(p)
    thigh, shin = b.thigh.halves, b.shin.halves
    turn, up, along = tm.revolute(), tm.prismatic((0.0, 1.0)), tm.prismatic((1.0, 0.0))
    c_hitch, c_thigh, c_shin = p.fitted_springs
    nothing, here, quarter = np.zeros((3, 3)), tm.placement((0.0, 0.0)), 0.5 * math.pi
    damping = p.slider_damping
    trunk = tm.planar_inertia(b.trunk.mass, (0.0, b.trunk.com), b.trunk.inertia)
    carriage = tm.planar_inertia(b.hitch_mass, (0.0, 0.0), b.hitch_inertia)
    foot = tm.planar_inertia(b.foot.mass, (b.foot_forward, -b.foot_drop), b.foot.inertia)
    bars = [tm.planar_inertia(s.mass, (s.com, 0.0), s.inertia) for s in (*thigh, *shin)]
    links = (
        tm.TreeLink(-1, here, along, nothing),
        tm.TreeLink(0, here, up, nothing),
        tm.TreeLink(1, here, turn, trunk),
        tm.TreeLink(2, here, up, carriage, c_hitch, 0.0, damping),
        tm.TreeLink(3, tm.placement((0.0, 0.0), -quarter), turn, bars[0]),
        tm.TreeLink(4, here, along, bars[1], c_thigh, 0.0, damping),
        tm.TreeLink(5, tm.placement((b.thigh.length, 0.0)), turn, bars[2]),
        tm.TreeLink(6, here, along, bars[3], c_shin, 0.0, damping),
        tm.TreeLink(
            7, tm.placement((b.shin.length, 0.0), quarter), turn, foot, p.ankle_stiffness, 0.0, p.ankle_damping
        ),
    )
    names = (*TRUNK, *LEG)
    return tm.Tree(links, (0.0, -p.gravity)).merged([k for k, n in enumerate(names) if n not in free])


def swing_motion(p: Parameters, free: tuple[str, ...], start: Array, rates: Array, times: Array) -> tuple[Array, Array]:
    """q, v (times, joints) of the passive leg from its own Lagrange equations in transition matrices, DOP853 to 1e-10."""
    t = tree(p, free)
    n = len(free)

    def slope(_: float, y: Array) -> Array:
        return np.concatenate([y[n:], tm.accelerations(t, y[:n], y[n:])])

    found = integrate_adaptive(slope, 0.0, np.concatenate([start, rates]), times[-1], rtol=1e-10, atol=1e-12)
    y = found.at(times)
    return y[:, :n], y[:, n:]


def reference(p: Parameters, scene: Scene) -> Recording:
    """The scene by transition matrices. Raises MechlabError for a scene with laws: they are for engines."""
    if scene.laws:
        raise MechlabError(
            f"prosthetic_leg: the transition matrices run passive scenes, {scene.name!r} has force laws; "
            "engines: mujoco, pinocchio."
        )
    free = FREE[scene.fidelity]
    m = build(p, scene.fidelity)
    t = np.linspace(0.0, scene.duration, 226)
    start = np.array([scene.initial.get(n, 0.0) for n in free])
    q, v = swing_motion(p, free, start, np.array([scene.initial_rates.get(n, 0.0) for n in free]), t)
    channels, units = basic_channels(m, q, v)
    settings = Settings(engine="analytic", integrator="DOP853", tolerance=1e-10)
    return Recording(m, t, q, v, channels, units, settings=settings, scene=scene.name, fidelity=scene.fidelity)


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """The leg of nine freedoms along a recording of any fidelity; joints it does not have stand at zero."""
    m = build(p, "full")
    q = np.zeros((len(recording.t), m.nq))
    for name in (*TRUNK, *LEG):
        if name in recording.channels:
            q[:, m.q_slice[name].start] = recording.channels[name]
    return m, q


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


def _engine(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    return Answer(_values(engine_terms(engine, build(p, "parts"), *_state(given))[2]))


OTHERS = [n for n in (*LEG, *(f"{n}_rate" for n in LEG)) if n not in ("hip", "knee")]
FREE_MOTION = Question(
    "free motion",
    given=("hip", "knee"),
    optional=dict.fromkeys(OTHERS, 0.0),
    answers=tuple(f"{n}_accel" for n in LEG),
    witnesses={"analytic": _analytic} | for_engines(_engine),
    units=with_rates({n: "m" if n in ("hitch", "thigh", "shin") else "rad" for n in LEG}),
    text="accelerations of the passive leg of six freedoms in a state, trunk fixed",
)


def random_states(count: int, joints: int, seed: int = 4) -> tuple[Array, Array]:
    """q, v (count, joints): slides and turns of a tenth to a half, rates of a few per second."""
    rng = np.random.default_rng(seed)
    return 0.5 * rng.standard_normal((count, joints)), 3.0 * rng.standard_normal((count, joints))


LOCKED = {
    "lock_thigh_shin": ("thigh", "shin"),
    "lock_hitch": ("hitch",),
    "lock_slides": ("hitch", "thigh", "shin"),
    "lock_slides_ankle": ("hitch", "thigh", "shin", "ankle"),
}
"""What is locked in each reduced model."""

SAMPLES = 46
"""One each 10 ms of the swing, on the steps of 1 ms."""


def hitch_sag(p: Parameters) -> float:
    """Displacement of the hitch at which its spring carries carriage and leg [m], negative: downwards."""
    t = tree(p)
    return float(tm.gravity_force(t, np.zeros(len(LEG)))[0] / c) if (c := p.fitted_springs[0]) > 0.0 else 0.0


def ankle_path(p: Parameters, q: Mapping[str, Array]) -> Array:
    """(n, 2) ankle in the sagittal plane from the joints given; the others are zero."""
    b = body(p)
    zero = np.zeros(len(next(iter(q.values()))))
    get = {n: q.get(n, zero) for n in LEG}
    hip, knee = get["hip"] - 0.5 * np.pi, get["hip"] + get["knee"] - 0.5 * np.pi
    upper, lower = b.thigh.length + get["thigh"], b.shin.length + get["shin"]
    x = upper * np.cos(hip) + lower * np.cos(knee)
    return np.column_stack([x, get["hitch"] + upper * np.sin(hip) + lower * np.sin(knee)])


def answers(p: Parameters, witness: str, duration: float) -> dict[str, float]:
    """Ankle path errors [m] of the reduced models over `duration`, the error without slides when the hitch
    spring starts unloaded (a start transient), and the largest travel of each slide.

    The models with a hitch start at its sag; those without have the hip there.
    """
    return dict(_answers(p, witness, duration))


@lru_cache(maxsize=16)
def _answers(p: Parameters, witness: str, duration: float) -> dict[str, float]:
    times = np.linspace(0.0, duration, SAMPLES)
    sag = hitch_sag(p)
    whole = swing_paths(p, witness, LEG, times, sag)
    truth = ankle_path(p, whole)
    out: dict[str, float] = {}
    for name, locked in LOCKED.items():
        free = tuple(n for n in LEG if n not in locked)
        less = swing_paths(p, witness, free, times, sag if "hitch" in free else 0.0)
        path = ankle_path(p, less) + np.array([0.0, 0.0 if "hitch" in free else sag])
        out[f"{name}_error"] = float(np.max(np.linalg.norm(path - truth, axis=1)))
    unloaded = ankle_path(p, swing_paths(p, witness, LEG, times, 0.0))
    rigid = tuple(n for n in LEG if n not in LOCKED["lock_slides"])
    path = ankle_path(p, swing_paths(p, witness, rigid, times, 0.0))
    out["lock_slides_unloaded_error"] = float(np.max(np.linalg.norm(path - unloaded, axis=1)))
    for name in ("hitch", "thigh", "shin"):
        out[f"{name}_travel"] = float(np.max(np.abs(whole[name] - whole[name][0])))
    return out


def swing_paths(p: Parameters, witness: str, free: tuple[str, ...], times: Array, hitch: float) -> dict[str, Array]:
    """Joints over times (n,) in the swing with those in `free`, the hitch starting at `hitch` [m]; witness: "analytic" or an engine."""
    start = SWING_START | {"hitch": hitch}
    initial, rates = {n: start.get(n, 0.0) for n in free}, {n: SWING_RATES.get(n, 0.0) for n in free}
    if witness == "analytic":
        q, _ = swing_motion(p, free, np.array(list(initial.values())), np.array(list(rates.values())), times)
        return dict(zip(free, q.T, strict=True))
    scene = Scene("swing", "parts", float(times[-1]), (), initial, rates)
    settings = Settings(engine=witness, integrator="RK4", timestep=1e-3)
    run = engine(witness).at_times(mechanism(p, free), scene, settings, times)
    return {n: np.array([run.at(n, t) for t in times]) for n in free}


def _ask(witness: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    duration = float(given["swing_duration"])
    found = answers(p, witness, duration)
    errors = {"hitch": "lock_hitch_error", "thigh and shin": "lock_thigh_shin_error"}
    needed = [n for n, key in errors.items() if found[key] > ALLOWED]
    note = f"for {1e3 * ALLOWED:g} mm at the ankle the swing needs: {', '.join(needed) or 'no slide'}"
    return Answer(found, notes=(note,))


ALLOWED = 5e-3
"""Error of the ankle that a swing model may have [m]."""

KEYS = (*(f"{n}_error" for n in LOCKED), "lock_slides_unloaded_error", "hitch_travel", "thigh_travel", "shin_travel")
SLIDES = Question(
    "which slides does the swing need",
    given=("swing_duration",),
    answers=KEYS,
    witnesses={"analytic": lambda p, given: _ask("analytic", p, given)} | for_engines(_ask),
    units={"swing_duration": "s"} | dict.fromkeys(KEYS, "m"),
    text="largest error of the ankle's path when joints are locked, over a swing that starts at the hitch's sag",
)
