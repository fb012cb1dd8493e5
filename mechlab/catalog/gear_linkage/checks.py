"""Checks of the three-gear four-bar: each compares witnesses that do not share code.

Moving states in particles; the regime and the transmission angle from samples of rolling alone.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import astuple, replace

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.gear_linkage.build import (
    NEAR_CHANGE_POINT,
    Parameters,
    build,
    constant_crank,
    coordinates,
    free_spin,
    near_change_point,
    reference,
)
from mechlab.catalog.gear_linkage.questions import MOTION
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.scene import Settings
from mechlab.kit.benchmark_parts import in_plane
from mechlab.kit.checks import EXACT, by_witnesses, moving_check
from mechlab.kit.mass_check import Particles, State, rod, solid
from mechlab.mechanism import TreeKinematics
from mechlab.mechanism.geometry import Array, axis_rotation

STATES = ((0.6, 1.3), (2.5, -0.8))
"""Crank angle [rad] and rate [rad/s]: one behind the reference pose, one ahead."""


def state(p: Parameters, phi: float, w: float) -> State:
    """A crank angle and rate: bars between the moving pins A, B, C, D, uniform discs about B, C, D."""
    x = closed_form.motion(p.linkage, phi, w)
    turns = {n: float(getattr(x, f"{n}_angle")) for n in ("coupler", "rocker", "idler", "output")}
    rates = {n: float(getattr(x, f"{n}_rate")) for n in turns}
    ra, rc, rd = p.linkage.radii
    pin_b, pin_d = cmath.rect(p.crank, phi), complex(p.frame)
    pin_c = pin_d + cmath.rect(p.rocker, turns["rocker"])
    vb, vc = 1j * w * pin_b, 1j * rates["rocker"] * (pin_c - pin_d)
    ends = {"A": (0j, 0j), "B": (pin_b, vb), "C": (pin_c, vc), "D": (pin_d, 0j)}

    def bar(a: str, b: str, length: float) -> Particles:
        (pa, va), (pb, vb) = ends[a], ends[b]
        return rod(p.mass_per_length * length, in_plane(pa), in_plane(pb), in_plane(va), in_plane(vb))

    def gear(at: str, radius: float, rate: float) -> Particles:
        place, velocity = (in_plane(z) for z in ends[at])
        mass = p.mass_per_area * math.pi * radius**2
        return solid(mass, place, (0.5 * radius, 0.5 * radius, 0.0), velocity=velocity, turn=(0.0, 0.0, rate))

    particles = bar("A", "B", p.crank) + bar("B", "C", p.coupler) + bar("D", "C", p.rocker)
    particles = particles + gear("B", ra, w) + gear("C", rc, rates["idler"]) + gear("D", rd, rates["output"])
    joint = turns["coupler"] - phi
    values = {f"{n}_angle": x for n, x in turns.items()}
    values |= {"crank_angle": phi, "coupler_joint": joint, "idler_joint": ra / rc * joint}
    speeds = {f"{n}_angle": v for n, v in rates.items()} | {
        "crank_angle": w, "coupler_joint": rates["coupler"] - w, "idler_joint": rates["idler"] - rates["coupler"],
    }  # fmt: skip
    rim = pin_d + cmath.rect(rd, turns["output"])
    points = {"B": in_plane(pin_b), "C": in_plane(pin_c), "rim": in_plane(rim)}
    # The phase of the idler's teeth has no dynamic effect: its body turns with the coupler and, by its joint, on it.
    idler = axis_rotation((0.0, 0.0, 1.0), turns["coupler"] + ra / rc * joint)
    poses = {"idler": (idler, np.array(in_plane(pin_c)))}
    energy = 0.5 * p.load_inertia * rates["output"] ** 2
    if p.load_inertia:
        values["load"], speeds["load"] = turns["output"], rates["output"]
    return State(values, speeds, particles, points, (0.0, 0.0, 0.0), 1, energy, poses=poses)


SAMPLES = 40_001
BACK = math.radians(2.0)
"""Reverse motion of the output [rad] for which the crank length is found."""


def _transmission(g: closed_form.GearLinkage, phi: Array) -> Array:
    """Angle BCD by the law of cosines."""
    square = g.crank**2 + g.frame**2 - 2.0 * g.crank * g.frame * np.cos(phi)
    return np.asarray(np.arccos((g.coupler**2 + g.rocker**2 - square) / (2.0 * g.coupler * g.rocker)))


def _sampled(g: closed_form.GearLinkage) -> list[float]:
    """The numbers of a RegimeReport for an output that runs back, from sampled rolling rates over one turn."""
    phi = np.linspace(0.0, 2.0 * math.pi, SAMPLES)
    w = closed_form.rolling_rates(g, phi)[1]
    least, least_at = _extreme(phi, w)
    most, most_at = _extreme(phi, -w)
    turn = phi - math.pi + least_at  # one turn around the slowest place
    w = closed_form.rolling_rates(g, turn)[1]
    moved = np.concatenate([[0.0], np.cumsum(0.5 * (w[1:] + w[:-1]) * np.diff(turn))])
    signs = np.flatnonzero(np.diff(np.sign(w)))
    stop, back = (float(turn[k] - w[k] * (turn[k + 1] - turn[k]) / (w[k + 1] - w[k])) for k in signs[[0, -1]])
    place, low = (float(np.interp(x, turn, moved)) for x in (stop, back))
    late = turn > back
    regained = float(np.interp(place, moved[late], turn[late]))
    mu = _transmission(g, phi)
    acute = float(np.min(np.minimum(mu, math.pi - mu)))
    return [least, least_at, -most, most_at, stop, back, place - low, back - stop, regained - stop, acute]


def _extreme(phi: Array, w: Array) -> tuple[float, float]:
    """Smallest value and its place, by the parabola through the three lowest of a periodic table."""
    k = int(np.argmin(w[:-1]))
    before, here, after = w[k - 1 if k else -2], w[k], w[k + 1]
    bend = before - 2.0 * here + after
    step = 0.5 * (before - after) / bend
    return float(here - 0.5 * bend * step**2), float(phi[k] + step * (phi[1] - phi[0])) % (2.0 * math.pi)


def _with_crank_for(g: closed_form.GearLinkage, target: str, wanted: float) -> closed_form.GearLinkage:
    """The linkage with the crank that the synthesis finds for a target."""
    crank = closed_form.crank_for(target, wanted, g.coupler, g.rocker, g.idler_radius, g.frame, g.mode).crank
    if crank is None:
        raise MechlabError(f"gear_linkage: {target} of {wanted:.4g} rad is out of reach with these gears.")
    return replace(g, crank=crank)


def _regime(p: Parameters) -> CheckResult:
    reversing = _with_crank_for(p.linkage, "reverse_angle", BACK)
    report = astuple(closed_form.regime(reversing))[1:]
    note = "RegimeReport of a crank that runs back by 2 deg"
    # Parabolas and chords over steps of 1.6e-4 rad: 1e-8 of second derivatives, which grow towards a change point.
    return CheckResult({"closed form": report}, 1e-5, _sampled(reversing), note)


def _reach(p: Parameters) -> CheckResult:
    """The transmission angle over a turn, and what `crank_for` returns besides the crank."""
    g, phi = p.linkage, np.linspace(0.0, 2.0 * math.pi, 101)
    found = closed_form.crank_for("reverse_angle", BACK, g.coupler, g.rocker, g.idler_radius, g.frame, g.mode)
    at_rest = replace(g, crank=found.momentary_crank)
    longest = min(g.coupler + g.rocker - g.frame, g.frame - abs(g.coupler - g.rocker)) * (1.0 - 1e-6)
    stops = float(np.min(closed_form.rolling_rates(at_rest, np.linspace(0.0, 2.0 * math.pi, SAMPLES))[1]))
    most = closed_form.regime(replace(g, crank=longest)).reverse_angle
    measured = [found.wanted, found.longest, *found.reachable, stops, *closed_form.motion(g, phi).transmission_angle]
    expected = [BACK, longest, 0.0, most, 0.0, *_transmission(g, phi)]
    note = "reach of the synthesis, rest of its shortest crank, angles BCD"
    # The smallest of 40001 samples lies 1e-8 of a second derivative above the minimum; arccos keeps half the digits at 0.
    return CheckResult({"closed form": measured}, 1e-6, expected, note)


TURN = np.linspace(0.0, 2.0 * math.pi, 101)[:-1]
GRID = (0.35, 1.4, 2.2, 3.6, 4.9, 5.8)


def _both(p: Parameters) -> tuple[closed_form.GearLinkage, closed_form.GearLinkage]:
    return p.linkage, replace(p.linkage, mode=-p.mode)


def _pose(p: Parameters) -> CheckResult:
    given = [{"crank_angle": phi, "crank_rate": 1.3, "crank_accel": -0.7} for phi in GRID]
    question = replace(MOTION, answers=MOTION.answers[:6])
    note = "output and idler at 6 crank angles: angles, rates, accelerations"
    return by_witnesses(p, question, given, 1e-8, note, turned=False)


def _rolling(p: Parameters) -> CheckResult:
    motions = [closed_form.motion(g, TURN) for g in _both(p)]
    formula = np.array([[x.idler_rate, x.output_rate] for x in motions])
    rolling = np.array([closed_form.rolling_rates(g, TURN) for g in _both(p)])
    return CheckResult({"formula": formula, "rolling": rolling}, 1e-8, note="idler and output rate, both modes")


def _accelerations(p: Parameters) -> CheckResult:
    h = 1e-5
    formula = np.array([closed_form.motion(g, TURN).output_accel for g in _both(p)])
    ahead, behind = (np.array([closed_form.rolling_rates(g, TURN + s * h)[1] for g in _both(p)]) for s in (1, -1))
    scale = float(np.max(np.abs(formula)))
    # Central differences: truncation h^2 w''' / 6 and rounding 1e-16 / h, both below 1e-8 of the largest acceleration
    # unless a change point is near, where the third derivative grows as its fourth power.
    return CheckResult(
        {"formula": formula / scale, "differences of rolling": (ahead - behind) / (2.0 * h) / scale},
        1e-7, note=f"output acceleration, both modes, relative to the largest, {scale:.3g}",
    )  # fmt: skip


def _mean(p: Parameters) -> CheckResult:
    turn, ratio = 2.0 * math.pi, p.linkage.ratio
    measured = {f"mode {g.mode:+d}": float(closed_form.motion(g, turn).output_angle) / turn for g in _both(p)}
    return CheckResult(measured, 1e-12 * max(1.0, ratio), ratio, "mean output rate over one turn is ra / rd")


def _mass(p: Parameters) -> CheckResult:
    m = build(p, "minimal")
    tree = TreeKinematics(m)
    phi = np.array(GRID)
    q, v = coordinates(p, m, phi, np.ones_like(phi))
    found = [float(b @ tree.set(a).mass_matrix() @ b) for a, b in zip(q, v, strict=True)]
    expected = closed_form.reduced_inertia(p.linkage, p.masses, phi)[0]
    tolerance = 1e-12 * float(np.max(expected))
    return CheckResult({"G^T M G of the model": found}, tolerance, expected, "reduced inertia [kg m2]")


def _driven(p: Parameters) -> CheckResult:
    methods = {"RK4, 1 ms": Settings(), "implicitfast, 0.1 ms": Settings(integrator="implicitfast", timestep=1e-4)}
    scene = replace(constant_crank(replace(p, speed=1.0), "minimal"), duration=3.7)
    measured = {}
    for name, settings in methods.items():
        recording = engine("mujoco").run(build(p, "minimal"), scene, settings)
        truth = closed_form.motion(p.linkage, recording.channel("crank_angle")).output_angle
        measured[name] = float(np.max(np.abs(recording.channel("output_angle") - truth)))
    note = "output of a MuJoCo run against the closed form at the actual crank angle [rad]"
    return CheckResult(measured, 1e-5, 0.0, note)


def _free(p: Parameters) -> CheckResult:
    p = replace(p, speed=1.0)
    scene = free_spin(p, "minimal")
    expected = float(reference(p, scene).channel("output_angle")[-1])
    runs = (scene.settings or Settings(), EXACT)
    ends = {s.engine: engine(s.engine).at_times(build(p, "minimal"), scene, s, [scene.duration]) for s in runs}
    measured = {name: end.channel("output_angle")[-1] for name, end in ends.items()}
    note = "output angle after one turn let go, against the reduced equation [rad]"
    # Softness of MuJoCo's rows at 1 ms: phase 1.3e-5 rad after 18 rad, for the masses of the default parameters.
    return CheckResult(measured, 1e-4, expected, note)


def _mode(p: Parameters) -> CheckResult:
    near = Parameters(**NEAR_CHANGE_POINT, mode=p.mode)
    scene = near_change_point(near, "minimal")
    measured = []
    for settings in (scene.settings, replace(scene.settings, integrator="RK4", timestep=2e-4)):
        recording = engine("mujoco").run(build(near, "minimal"), replace(scene, duration=4.0), settings)
        chi, psi = recording.channel("rocker_angle"), recording.channel("coupler_angle")
        # sin(rocker - coupler) has the sign of the mode; only the last sample may have lost it.
        wrong = np.count_nonzero(near.mode * np.sin(chi - psi)[:-1] < 0.0)
        measured += [float(recording.health.finding("assembly_mode").severity == "error"), float(wrong)]
    note = "stopped (1) or not (0), and samples in the wrong mode: of a coarse run near the change point, of a fine one"
    return CheckResult({"mujoco": measured}, 0.0, [1.0, 0.0, 0.0, 0.0], note)


def _synthesis(p: Parameters) -> CheckResult:
    degrees = {"reverse_angle": 2.0, "dwell_angle": 60.0, "dwell_angle_one_sided": 90.0}
    targets = {target: math.radians(angle) for target, angle in degrees.items()}
    reports = {target: closed_form.regime(_with_crank_for(p.linkage, target, x)) for target, x in targets.items()}
    measured = [float(getattr(report, target)) for target, report in reports.items()]
    note = "2 deg back, 60 and 90 deg dwell"
    # Near the momentary dwell the dwell angle is the cube root of the reverse angle: rounding 1e-15 there, 1e-9 here.
    return CheckResult({"regime of the crank found": measured}, 1e-8, list(targets.values()), note)


CHECKS = (
    Check("L1", "output and idler from three witnesses", _pose, "closed form of the three-gear four-bar"),
    Check("L2", "rates against rolling at the pitch points, both modes", _rolling, "velocity of the pitch points"),
    Check("L3", "accelerations against differences of rolling, both modes", _accelerations, "central differences"),
    Check("L4", "mean output rate over a turn", _mean, "ra / rd"),
    Check("L5", "reduced inertia against the model", _mass, "Lagrange"),
    Check("L6", "driven run at the actual crank angle", _driven, "closed form"),
    Check("L7", "free run against the equation of the one freedom", _free, "Eksergian equation, DOP853"),
    Check("L8", "assembly mode near the change point", _mode, "sign of the triangle BCD"),
    Check("L9", "synthesis of the crank, checked by its regime", _synthesis, "root finding both ways"),
    moving_check("L10", build, "minimal", lambda p: (state(p, phi, w) for phi, w in STATES)),
    Check("L11", "regime of a reversing crank against samples", _regime, "rolling at the pitch points, sampled"),
    Check("L12", "reach of the synthesis and transmission angle", _reach, "law of cosines; rolling, sampled"),
)
