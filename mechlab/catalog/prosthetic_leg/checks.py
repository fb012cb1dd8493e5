"""Checks of the leg: own equations against both engines, the swing, its energy, the drop.

The moving state in particles is a walk down the chain in complex numbers, x forwards + i z up.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from functools import partial

import numpy as np

from mechlab.analytic import transition_matrices as tm
from mechlab.catalog.prosthetic_leg.build import (
    FREE,
    HEEL,
    LEG,
    SCENES,
    SWING_RATES,
    SWING_START,
    SWING_TIME,
    Parameters,
    body,
    build,
)
from mechlab.catalog.prosthetic_leg.questions import answers, engine_terms, own_terms, random_states, swing_motion, tree
from mechlab.engines.protocol import WITNESSES, engine
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.scene import Settings
from mechlab.kit.checks import moving_in_fidelities
from mechlab.kit.mass_check import NOTHING, Particles, State, solid, spread_of
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

STATE = {
    "trunk_x": (0.3, 0.7), "trunk_z": (-0.1, 0.4), "trunk": (0.2, -0.5), "hitch": (-0.02, 0.3), "hip": (0.5, 1.1),
    "thigh": (0.01, -0.2), "knee": (-0.8, -1.7), "shin": (-0.015, 0.25), "ankle": (0.15, 0.9),
}  # fmt: skip
"""Value and rate of every joint [m, rad, m/s, rad/s]."""


@dataclass(frozen=True)
class Place:
    """A frame of the plane: where it stands, how fast, its angle and turning rate (counter-clockwise from x to z)."""

    at: complex = 0j
    velocity: complex = 0j
    angle: float = 0.0
    rate: float = 0.0

    def point(self, arm: complex) -> tuple[complex, complex]:
        """World place and velocity of a point fixed in the frame."""
        z = arm * cmath.rect(1.0, self.angle)
        return self.at + z, self.velocity + 1j * self.rate * z

    def slid(self, way: complex, value: float, rate: float) -> Place:
        """The frame moved along its own direction `way` by a joint."""
        at, velocity = self.point(way * value)
        return Place(at, velocity + way * rate * cmath.rect(1.0, self.angle), self.angle, self.rate)

    def turned(self, start: float, value: float = 0.0, rate: float = 0.0, arm: complex = 0j) -> Place:
        """The frame of a part hung at a point of this one, turned by `start` and by a joint."""
        return Place(*self.point(arm), self.angle + start + value, self.rate + rate)

    def part(self, mass: float, moments: tuple[float, float, float], centre: complex) -> Particles:
        """A part in this frame: moments about its x, the normal of the plane (world -y), and its z; about its centre."""
        at, velocity = (_upright(z) for z in self.point(centre))
        c, s = math.cos(self.angle), math.sin(self.angle)
        axes = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        return solid(mass, at, spread_of(mass, moments), axes, velocity, (0.0, -self.rate, 0.0))


def state(p: Parameters, fidelity: str) -> State:
    """The joints of a fidelity as in STATE, the others held. A bar's moment along it is a tenth of that across; the trunk's
    along it three tenths."""
    free, size, quarter = FREE[fidelity], body(p), 0.5 * math.pi
    joints = {n: STATE[n] if n in free else (0.0, 0.0) for n in STATE}
    hip = Place().slid(1.0, *joints["trunk_x"]).slid(1j, *joints["trunk_z"]).turned(0.0, *joints["trunk"])
    particles = NOTHING
    if "trunk" in free:
        across = size.trunk.inertia
        particles = hip.part(size.trunk.mass, (across, across, 0.3 * across), 1j * size.trunk.com)
    carriage = hip.slid(1j, *joints["hitch"])
    particles = particles + carriage.part(size.hitch_mass, (size.hitch_inertia,) * 3, 0j)
    above, points = carriage.turned(-quarter, *joints["hip"]), {}
    for segment, slide, below, start in ((size.thigh, "thigh", "knee", 0.0), (size.shin, "shin", "ankle", quarter)):
        tube, end = above.slid(1.0, *joints[slide]), complex(segment.length)
        for half, host in zip(segment.halves, (above, tube), strict=True):
            bar = (0.1 * half.inertia, half.inertia, half.inertia)
            particles = particles + host.part(half.mass, bar, complex(half.com))
        points[f"{below}_point"] = tube.point(end)[0]
        above = tube.turned(start, *joints[below], arm=end)
    foot, moment = size.foot, size.foot.inertia
    centre = complex(size.foot_forward, -size.foot_drop)
    particles = particles + above.part(foot.mass, (0.1 * moment, moment, moment), centre)
    for name, x in (("heel", -HEEL), ("toe", foot.length - HEEL)):
        points[name] = above.point(complex(x, -size.sole))[0]
    springs = dict(zip(("hitch", "thigh", "shin"), p.fitted_springs, strict=True)) | {"ankle": p.ankle_stiffness}
    stored = sum(c * joints[n][0] * joints[n][1] for n, c in springs.items())
    dampers = {**dict.fromkeys(("hitch", "thigh", "shin"), p.slider_damping), "ankle": p.ankle_damping}
    lost = sum(b * joints[n][1] ** 2 for n, b in dampers.items())
    values, rates = ({n: joints[n][k] for n in free} for k in (0, 1))
    places = {n: _upright(z) for n, z in points.items()}
    return State(values, rates, particles, places, (0.0, 0.0, -p.gravity), len(free), stored=stored, lost=lost)


def _upright(z: complex) -> Array:
    return np.array([z.real, 0.0, z.imag])


TERMS = (
    ("mass matrix", "mass matrix"),
    ("velocity, weight and elastic terms", "velocity, weight, spring and damper terms"),
    ("accelerations", "accelerations"),
)
"""What the equations of motion consist of, M, h and qdd: in the text of a check and in its note."""
STATES = 50
DROP_TIMES = (0.08, 0.12, 0.2)


def _terms(k: int, note: str, p: Parameters) -> CheckResult:
    """Term k (M, h, qdd) at random states of the nine freedoms, each state relative to its largest entry."""
    m, t = build(p, "full"), tree(p, FREE["full"])
    q, v = random_states(STATES, len(FREE["full"]))
    own = own_terms(t, q, v)[k]
    axes = tuple(range(1, own.ndim))
    scale = np.max(np.abs(own), axis=axes, keepdims=True)
    measured = {"analytic": own / scale}
    for name in WITNESSES:
        measured[name] = np.array([engine_terms(name, m, a, b)[k] for a, b in zip(q, v, strict=True)]) / scale
    # Rounding of a 9 x 9 system: 1e-14 for M and h, times the condition of M (about 1e2) for the accelerations.
    return CheckResult(measured, 1e-12, note=f"{note} at {STATES} random states, relative to the largest entry of each")


def _swing_start() -> tuple[Array, Array]:
    return np.array([SWING_START.get(n, 0.0) for n in LEG]), np.array([SWING_RATES.get(n, 0.0) for n in LEG])


def _swing(p: Parameters) -> CheckResult:
    scene = SCENES["swing"].make(p, "parts")
    own, _ = swing_motion(p, LEG, *_swing_start(), np.array([0.0, SWING_TIME]))
    measured = {"analytic": own[-1]}
    for name in WITNESSES:
        settings = Settings(engine=name, integrator="RK4", timestep=1e-3)
        run = engine(name).at_times(build(p, "parts"), scene, settings, [scene.duration])
        measured[name] = np.array([run.channel(n)[-1] for n in LEG])
    # RK4 at 1 ms with modes of up to 48 Hz: 8.1e-9 measured, of order 4.
    return CheckResult(measured, 1e-7, note="joints at the end of the swing")


def _energy(p: Parameters) -> CheckResult:
    free = replace(p, slider_damping=0.0, ankle_damping=0.0)
    q, v = swing_motion(free, LEG, *_swing_start(), np.linspace(0.0, SWING_TIME, 10))
    kinetic, potential = tm.energy(tree(free), q, v)
    total = kinetic + potential
    # DOP853 at 1e-10 relative: a few 1e-9 J of some 30 J.
    note = "energy of the swing without dampers [J]"
    return CheckResult({"analytic": total}, 1e-7, np.full(len(total), total[0]), note)


def _sliders(p: Parameters) -> CheckResult:
    measured = {w: np.array(list(answers(p, w, SWING_TIME).values())) for w in WITNESSES}
    # Errors: travel is read at samples, each of two runs at 1 ms is off by 1e-8, and MuJoCo's clock counts whole steps.
    return CheckResult(measured, 1e-6, note="path errors of the ankle with joints locked, and travels [m]")


def _drop(p: Parameters) -> CheckResult:
    scene = replace(SCENES["stance-drop"].make(p, "full"), duration=DROP_TIMES[-1])
    measured = {}
    for name in WITNESSES:
        settings = Settings(engine=name, integrator="RK4", timestep=5e-4)
        run = engine(name).at_times(build(p, "full"), scene, settings, DROP_TIMES)
        measured[name] = np.array([[run.at(n, t) for t in DROP_TIMES] for n in ("hitch", "thigh", "shin")])
    # The contact switches within a step: first order locally, h^2 x impact acceleration (1e2 m/s2) = 3e-5 m at most.
    return CheckResult(measured, 3e-5, note="slides during the drop [m]")


CHECKS = (
    *(
        Check(f"L{k + 1}", f"{text} of nine freedoms", partial(_terms, k, note), "matrix Lagrange equations")
        for k, (text, note) in enumerate(TERMS)
    ),
    Check("L4", "end of the swing", _swing, "matrix Lagrange equations, DOP853 to 1e-10"),
    Check("L5", "energy of the undamped swing", _energy, "conservation"),
    Check("L6", "which slides the swing needs", _sliders, "two engines"),
    Check("L7", "drop onto the straight leg", _drop, "two engines", slow=True),
    moving_in_fidelities("L8", build, state, FREE),
)
