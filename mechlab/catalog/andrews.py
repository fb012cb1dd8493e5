"""A03: Andrews' squeezer, seven bodies and three loops in one plane, at 1000 rad/s within milliseconds."""

from __future__ import annotations

import cmath
from dataclasses import replace
from functools import lru_cache

import numpy as np

from mechlab.analytic.benchmarks.andrews import Squeezer
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.laws import Constant
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit import benchmark_parts as parts
from mechlab.kit import mass_check, palette
from mechlab.kit.checks import moving_check
from mechlab.kit.own_equations import record_own
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism, Placement, Spring, revolute, shape
from mechlab.mechanism.geometry import Array, axis_rotation

SOURCE = "Bari Test Set, Andrews' squeezing mechanism"
JOINTS = ("beta", "Theta", "gamma", "Phi", "delta", "Omega", "epsilon")
START = (
    -0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885885, 0.487364979543842550,
    -0.222668390165885885, 1.23054744454982119,
)  # fmt: skip


@dataclass(frozen=True)
class Parameters:
    """Lengths as in the Test Set (Hairer & Wanner, VII.7); masses and moments of K1 to K7."""

    torque: float = parameter(0.033, "N m", "torque on the crank at O", source=SOURCE, scene=True)
    spring_stiffness: float = parameter(4530.0, "N/m", "spring from C to D", source=SOURCE, low=0)
    spring_length: float = parameter(0.07785, "m", "its length without force", source=SOURCE, low=0)
    masses: tuple[float, float, float, float, float, float, float] = parameter(
        (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498),
        "kg",
        "masses of K1 to K7",
        source=SOURCE,
        low=0,
        strict=True,
    )
    inertias: tuple[float, float, float, float, float, float, float] = parameter(
        (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5), "kg m2", "moments about the centres of mass",
        source=SOURCE, low=0, strict=True,
    )  # fmt: skip
    a: tuple[float, float] = parameter((-0.06934, -0.00227), "m", "pivot A of K5 and K7", source=SOURCE)
    b: tuple[float, float] = parameter((-0.03635, 0.03273), "m", "pivot B of K3", source=SOURCE)
    c: tuple[float, float] = parameter((0.014, 0.072), "m", "anchor C of the spring", source=SOURCE)
    d: float = parameter(0.028, "m", "K2, from F to E", source=SOURCE, low=0, strict=True)
    da: float = parameter(0.0115, "m", "F to the centre of K2", source=SOURCE, low=0)
    e: float = parameter(0.02, "m", "K4, from G to E", source=SOURCE, low=0, strict=True)
    ea: float = parameter(0.01421, "m", "E to the centre of K4", source=SOURCE, low=0)
    rr: float = parameter(0.007, "m", "crank K1, from O to F", source=SOURCE, low=0, strict=True)
    ra: float = parameter(0.00092, "m", "O to the centre of K1", source=SOURCE, low=0)
    ss: float = parameter(0.035, "m", "K3, from B to E", source=SOURCE, low=0, strict=True)
    sa: float = parameter(0.01874, "m", "centre of K3 along B-E", source=SOURCE)
    sb: float = parameter(0.01043, "m", "centre of K3 across B-E", source=SOURCE)
    sc: float = parameter(0.018, "m", "D along B-E", source=SOURCE)
    sd: float = parameter(0.02, "m", "D across B-E", source=SOURCE)
    ta: float = parameter(0.02308, "m", "centre of K5 along A-G", source=SOURCE)
    tb: float = parameter(0.00916, "m", "centre of K5 across A-G", source=SOURCE)
    zt: float = parameter(0.04, "m", "K5, from A to G", source=SOURCE, low=0, strict=True)
    u: float = parameter(0.04, "m", "K7, from A to H", source=SOURCE, low=0, strict=True)
    ua: float = parameter(0.01228, "m", "centre of K7 along A-H", source=SOURCE)
    ub: float = parameter(0.00449, "m", "centre of K7 across A-H", source=SOURCE)
    zf: float = parameter(0.02, "m", "K6, from H to E", source=SOURCE, low=0, strict=True)
    fa: float = parameter(0.01421, "m", "E to the centre of K6", source=SOURCE, low=0)
    gravity: float = parameter(0.0, "m/s2", "gravity, along -y", source=SOURCE)
    start_angle: float = parameter(START[0], "rad", "crank angle at the start", source=SOURCE)
    start_rate: float = parameter(0.0, "rad/s", "crank speed at the start", source=SOURCE, scene=True)
    duration: float = parameter(0.05, "s", "duration of the scene", source=SOURCE, low=0, strict=True, scene=True)


def own(p: Parameters) -> Squeezer:
    """The closed form of the squeezer: one equation of motion, in the crank angle."""
    names = "a b c d da e ea rr ra ss sa sb sc sd zt ta tb u ua ub zf fa torque spring_stiffness spring_length gravity"
    same = {n: getattr(p, n) for n in names.split()}
    return Squeezer(masses=p.masses, inertias=p.inertias, start=START, **same)


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """Seven bars as a tree (K2 on K1, K4 on K5, K6 on K7) and three pins in E; the reference pose is that of the start."""
    b = Builder("andrews", gravity=(0.0, -p.gravity, 0.0), summary="Andrews' squeezer, benchmark A03")
    k = {n: j.value.real for n, j in own(p).pose(p.start_angle)[0].items()}
    values = dict(zip(JOINTS, own(p).states(np.array([[p.start_angle, 0.0]]))[0][0], strict=True))
    a, pivot = (*p.a, 0.0), (*p.b, 0.0)
    rows: tuple[tuple[str, str, str, tuple[float, ...], float, tuple[float, float], float], ...] = (
        ("K1", "beta", "ground", (0.0, 0.0, 0.0), p.rr, (p.ra, 0.0), 0.0),
        ("K2", "Theta", "K1", (p.rr, 0.0, 0.0), p.d, (p.da, 0.0), 1.0),
        ("K3", "gamma", "ground", pivot, p.ss, (p.sa, p.sb), 0.0),
        ("K5", "delta", "ground", a, p.zt, (p.ta, p.tb), 0.0),
        ("K4", "Phi", "K5", (p.zt, 0.0, 0.0), p.e, (p.e - p.ea, 0.0), 2.0),
        ("K7", "epsilon", "ground", a, p.u, (p.ua, p.ub), -1.0),
        ("K6", "Omega", "K7", (p.u, 0.0, 0.0), p.zf, (p.zf - p.fa, 0.0), 3.0),
    )
    c = palette
    paints = (c.ROSE, c.ORANGE, c.TEAL, c.GOLD, c.BLUE, c.GOLD, c.BLUE)
    colors = {f"K{i}": paint for i, paint in enumerate(paints, 1)}
    for name, joint, parent, at, length, centre, layer in rows:
        angle = k[name] - (k[parent] if parent != "ground" else 0.0)
        hinge, lift = revolute(joint, "z", zero=float(values[joint])), 0.0013 * layer
        if name == "K3":  # it also carries the spring
            b.plate(name, hinge, [(length, 0.0), (p.sc, p.sd)], parent=parent, at=at, width=0.003, color=colors[name], layer=lift)
        else:
            b.bar(name, hinge, length, parent=parent, at=at, width=0.003, color=colors[name], layer=lift)
        number = int(name[1]) - 1
        parts.with_inertia(b, parts.planar(p.masses[number], p.inertias[number], *centre))
        _turn(b, angle)
    ends = {"K2": p.d, "K3": p.ss, "K4": p.e, "K6": p.zf}
    for name in ("K3", "K4", "K6"):
        b.loop(f"E_{name}", "K2", name, (ends["K2"], 0.0, 0.0), (ends[name], 0.0, 0.0))
    b.spring(Spring("spring", "ground", "K3", (*p.c, 0.0), (p.sc, p.sd, 0.0), p.spring_stiffness, 0.0, p.spring_length))
    b.frame("F", "K1", (p.rr, 0.0, 0.0)).frame("E", "K2", (p.d, 0.0, 0.0)).frame("D", "K3", (p.sc, p.sd, 0.0))
    b.ground(shape("cylinder", Placement((*p.c, 0.0)), palette.SLATE, "anchor", radius=0.0015, length=0.004))
    return b.build()


def _turn(b: Builder, angle: float) -> None:
    body = b.bodies[-1]
    turned = Placement.of(axis_rotation((0.0, 0.0, 1.0), angle), body.placement.translation)
    b.bodies[-1] = replace(body, placement=turned)


def moving(p: Parameters, angle: float, speed: float) -> mass_check.State:
    """The state at a crank angle [rad] and rate [rad/s] in particles; spring power = pull . velocity of its end."""
    jets, pins = own(p).pose(angle)
    turn = {n: j.value.real for n, j in jets.items()}
    rate = {n: j.first.real * speed for n, j in jets.items()}
    ends = {n: (j.value, j.first * speed) for n, j in pins.items()}
    ends |= {"O": (0j, 0j), "A": (complex(*p.a), 0j), "B": (complex(*p.b), 0j)}

    def point(body: str, pin: str, at: complex) -> tuple[complex, complex]:
        """Position and velocity of the point of a body that lies `at` (body axes) from its pin `pin`."""
        (place, velocity), arm = ends[pin], at * cmath.rect(1.0, turn[body])
        return place + arm, velocity + 1j * rate[body] * arm

    centres = {
        "K1": ("O", complex(p.ra)), "K2": ("F", complex(p.da)), "K3": ("B", complex(p.sa, p.sb)), "K4": ("G", p.e - p.ea + 0j),
        "K5": ("A", complex(p.ta, p.tb)), "K6": ("H", p.zf - p.fa + 0j), "K7": ("A", complex(p.ua, p.ub)),
    }  # fmt: skip
    particles = mass_check.NOTHING
    for (body, where), mass, moment in zip(centres.items(), p.masses, p.inertias, strict=True):
        particles = particles + parts.planar_particles(mass, moment, *point(body, *where), turn[body], rate[body])
    d, d_rate = point("K3", "B", complex(p.sc, p.sd))
    way = d - complex(*p.c)
    pull = p.spring_stiffness * (abs(way) - p.spring_length) * way / abs(way)
    q, v = own(p).states(np.array([[angle, speed]]))
    points = {"F": ends["F"][0], "E": ends["E"][0], "D": d}
    return mass_check.State(
        dict(zip(JOINTS, q[0], strict=True)), dict(zip(JOINTS, v[0], strict=True)), particles,
        {n: parts.in_plane(z) for n, z in points.items()}, (0.0, -p.gravity, 0.0), 1,
        stored=(pull.conjugate() * d_rate).real,
    )  # fmt: skip


CHANNELS = parts.tracked("F", "xy", "F_")


def _squeeze(p: Parameters, fidelity: str) -> Scene:
    laws = (Constant("beta", p.torque),) if p.torque else ()
    return Scene(
        "squeeze", fidelity, p.duration, laws, {"beta": p.start_angle}, {"beta": p.start_rate}, tuple(CHANNELS),
        tolerance=1e-5, settings=Settings(timestep=1e-5),
    )  # fmt: skip


def reference(p: Parameters, scene: Scene, method: str = "DOP853", tolerance: float = 1e-13) -> Recording:
    """The equation of the crank alone; dyads give the other six angles."""
    m, equation = build(p, "full"), own(p)

    def states(y: Array) -> tuple[Array, Array]:
        values, rates = equation.states(y)
        return parts.columns(m, dict(zip(JOINTS, values.T, strict=True)), dict(zip(JOINTS, rates.T, strict=True)))

    start = np.array([scene.initial["beta"], scene.initial_rates["beta"]])
    return record_own(m, scene, equation.slope, start, states, method, tolerance)


PRINTED = {
    0.005: (0.00684464175425, 0.001466587623),
    0.025: (0.00627478524952, -0.00310275201593),
    0.05: (-0.00520850472225, 0.00467669526036),
}
TEST_SET = (
    15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
    0.5347301163226948, 1.048080741042263,
)  # fmt: skip
TEST_SET_RATES = (
    1139.920302151208, -1424.379294994111, 11.03291221937134, 19.29337464421385, 0.5735699284790808,
    -19.29337464421385, 0.3231791658026955,
)  # fmt: skip


def _check_test_set(p: Parameters) -> CheckResult:
    default = replace(Parameters(), duration=0.03)
    found = reference(default, _squeeze(default, "full"))
    q = [found.channel(n)[-1] for n in JOINTS]
    v = [found.channel(f"{n}_rate")[-1] / 1e3 for n in JOINTS]
    # Printed by PSIDE at 1e-14; coordinates agree to 1.4e-9, rates to 5e-8 relative (measured with DOP853 at 1e-13).
    expected = [*TEST_SET, *(x / 1e3 for x in TEST_SET_RATES)]
    return CheckResult({"analytic": [*q, *v]}, 1e-7, expected, "seven angles [rad] and rates [1000 rad/s] at 0.03 s")


PROBLEM = parts.Benchmark(Parameters, build, _squeeze, reference, CHANNELS, PRINTED, 1e-6)
ENTRY = PROBLEM.entry(
    bodies="seven bars, three loops",
    scene="squeeze",
    text="a constant torque on the crank, from rest",
    name="andrews",
    title="Andrews' squeezer (A03)",
    family="benchmark",
    summary="Benchmark A03: seven bodies, three loops, tiny lengths and high speed.",
    checks=(
        Check("B3", "own equation against the Test Set's solution at 0.03 s", _check_test_set, source=SOURCE),
        moving_check(
            "B4", build, "full", lambda p: (moving(p, p.start_angle + a, w) for a, w in ((0.4, 1.3), (2.5, -0.8)))
        ),
    ),
    chain="7R, 3 loops",
    formulas="dyads K2-K3, K5-K4, K7-K6 give the pose; J b'' + J'/2 b'^2 = torque + spring (Eksergian).",
    sources=("Schiehlen 1990", "Mazzia & Magherini: Test Set for IVP Solvers (Bari)", "Hairer & Wanner 1996, VII.7"),
)
