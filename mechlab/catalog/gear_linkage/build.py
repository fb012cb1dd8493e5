"""The three-gear four-bar: parameters, presets of its uses, the Mechanism, scenes and their closed form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

import numpy as np

from mechlab.analytic import gear_linkage as closed_form
from mechlab.catalog.gear_linkage.loads import load_laws
from mechlab.catalog.gear_linkage.looks import crank_looks, gear_looks, ground_looks, rod_looks, tooth_counts
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import Law, Servo, Viscous
from mechlab.experiment.motion import Ramp
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.own_equations import one_freedom_slope, record_own
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Inertia, LinearRelation, Mechanism, Placement, as_fraction, revolute
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.shapes import external_phase

OURS = "ours; the source prints no dimensions"


@dataclass(frozen=True)
class Parameters:
    """Lengths, idler, assembly mode, play, masses and speed of the three-gear four-bar."""

    crank: float = parameter(
        0.4728822419, "m", "crank A-B, the eccentricity of gear a", low=0, strict=True,
        source="ours: the output runs back by 2 deg (synthesis)",
    )
    coupler: float = parameter(1.0, "m", "coupler B-C = ra + rc", low=0, strict=True, source=OURS)
    rocker: float = parameter(1.0, "m", "rocker D-C = rc + rd", low=0, strict=True, source=OURS)
    frame: float = parameter(1.0, "m", "frame A-D", low=0, strict=True, source=OURS)
    idler_radius: float = parameter(0.5, "m", "pitch radius of the idler at C", low=0, strict=True, source=OURS)
    mode: int = parameter(1, "", "+1: C left of the ray from B to D, -1: right", low=-1, high=1)
    backlash: float = parameter(0.0, "rad", "play of the gears, seen at the output", low=0, source=OURS)
    mass_per_length: float = parameter(1.0, "kg/m", "uniform bars", low=0, strict=True)
    mass_per_area: float = parameter(2.0, "kg/m2", "uniform discs of the gears", low=0, strict=True)
    speed: float = parameter(1.0, "rad/s", "crank speed of the scenes")
    load_inertia: float = parameter(0.0, "kg m2", "what the output drives: transporter and sheet, rollers and strip", low=0, source=OURS)
    load_drag: float = parameter(0.0, "N m s", "drag of sheet or strip, seen at the output", low=0, source=OURS)
    cut_torque: float = parameter(0.0, "N m", "largest torque of a cutter on the crank, while the output stands", low=0, source=OURS)

    def __post_init__(self) -> None:
        if self.mode not in (1, -1):
            raise MechlabError(f"gear_linkage: mode must be +1 or -1, got {self.mode}.")
        self.linkage  # noqa: B018  its own conditions are those of the parameters

    @property
    def play(self) -> float:
        """The backlash [rad], larger by 1e-6 of it: a rounded crank length that was found for this play still fits."""
        return self.backlash * (1.0 + 1e-6)

    @property
    def linkage(self) -> closed_form.GearLinkage:
        """The same linkage for the closed form; raises for dimensions that do not go together."""
        return closed_form.GearLinkage(self.crank, self.coupler, self.rocker, self.idler_radius, self.frame, self.mode)

    @property
    def masses(self) -> closed_form.LinkageMasses:
        """Masses for the closed form."""
        return closed_form.LinkageMasses(self.mass_per_length, self.mass_per_area, self.load_inertia)


PRESETS: Mapping[str, Mapping[str, float]] = {
    # One output turn a crank turn with an instantaneous stop: replaces a clutch that engages once a cycle.
    "knife-drive": {
        "crank": 0.4428909829, "coupler": 1.0, "rocker": 1.0, "idler_radius": 0.5, "frame": 1.0, "backlash": 0.0,
    },
    # Never stops; fastest (and, there, of constant speed) where the sheet is gripped, about a sixth of it at release.
    "sheet-delivery": {
        "crank": 0.35, "coupler": 1.0, "rocker": 0.8, "idler_radius": 0.4, "frame": 1.0, "backlash": 0.0,
        "load_inertia": 0.5, "load_drag": 0.4,
    },
    # A play of 2 deg makes a stop of 51.7 deg, 73.5 deg when the gears only push: time to cut the glued strip.
    "glue-and-cut": {
        "crank": 0.548521886, "coupler": 0.9, "rocker": 0.9, "idler_radius": 0.3, "frame": 1.0,
        "backlash": math.radians(2.0), "load_inertia": 0.2, "load_drag": 0.2, "cut_torque": 5.0,
    },
}  # fmt: skip
"""Parameter sets of the uses that the source names. It prints no dimensions: these are ours, of the kind it describes."""

NEAR_CHANGE_POINT: Mapping[str, float] = {
    "crank": 0.79999, "coupler": 0.9, "rocker": 0.9, "idler_radius": 0.3, "frame": 1.0,
}  # fmt: skip
"""A crank 1e-5 short of the change point: coupler and rocker come within 0.4 deg of one line."""


def warnings(p: Parameters) -> tuple[str, ...]:
    """Sentences on doubtful parameters: a bad transmission angle, a play that the reverse motion exceeds."""
    report = closed_form.regime(p.linkage) if not p.linkage.at_change_point else None
    if report is None:
        return ("crank: at this length coupler, rocker and frame come into one line: a change point, where modes meet",)
    out = []
    if report.least_transmission_angle < math.radians(20.0):
        out.append(
            f"the transmission angle falls to {math.degrees(report.least_transmission_angle):.3g} deg; "
            "below 20 deg the drive is poor, and near 0 another assembly mode is close"
        )
    if 0.0 < p.play < report.reverse_angle:
        out.append(
            f"backlash: the output runs back by {report.reverse_angle:.4g} rad, more than the play of {p.backlash:.4g} rad: "
            "it does not stand"
        )
    return tuple(out)


START = 1.0
"""Crank angle of the reference pose [rad]: away from 0 and pi, where a change point would be."""


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """Five bodies, 5 coordinates, 3 rows of the loop (one void) and 2 gear relations: one freedom.

    `output_angle` is 0 at crank angle 0. The relations are exact ratios of the lengths as written.
    """
    if fidelity != "minimal":
        raise unknown("gear_linkage: fidelity", fidelity, ("minimal",))
    g = p.linkage
    at = closed_form.motion(g, START)
    psi, chi, out = float(at.coupler_angle), float(at.rocker_angle), float(at.output_angle)
    ra, rc, rd = g.radii
    b = Builder("gear_linkage", gravity=(0.0, 0.0, 0.0), summary="four-bar with three gears at B, C and D")
    disc_a = _disc(p, ra, (p.crank, 0.0, 0.0))
    # Relations count from the placements as written; these coordinates are how far the gears have turned from there.
    idler = ra / rc * (psi - START)
    turned = (1.0 + rc / rd) * chi - rc / rd * (psi + idler)
    teeth = tooth_counts(g)
    phases = _phases(teeth, (START, psi, chi), (psi + idler, out))
    rod = Inertia.rod
    b.body("crank", revolute("crank_angle"), inertia=rod(p.mass_per_length * p.crank, (0, 0, 0), (p.crank, 0, 0)) + disc_a,
           shapes=crank_looks(g, teeth[0], phases[0]))  # fmt: skip
    b.body("coupler", revolute("coupler_joint"), parent="crank", at=(p.crank, 0.0, 0.0),
           inertia=rod(p.mass_per_length * p.coupler, (0, 0, 0), (p.coupler, 0, 0)), shapes=rod_looks(g, "coupler"))  # fmt: skip
    b.body("idler", revolute("idler_joint"), parent="coupler", at=(p.coupler, 0.0, 0.0), inertia=_disc(p, rc),
           shapes=gear_looks(g, "idler", teeth[1], phases[1]))  # fmt: skip
    b.body("rocker", revolute("rocker_angle"), at=(p.frame, 0.0, 0.0),
           inertia=rod(p.mass_per_length * p.rocker, (0, 0, 0), (p.rocker, 0, 0)), shapes=rod_looks(g, "rocker"))  # fmt: skip
    b.body("output", revolute("output_angle", zero=out - turned), at=(p.frame, 0.0, 0.0), inertia=_disc(p, rd),
           turned=Placement.of(axis_rotation((0.0, 0.0, 1.0), out - turned), (0.0, 0.0, 0.0)),
           shapes=gear_looks(g, "output", teeth[2], phases[2]))  # fmt: skip
    b.loop("joint_C", "coupler", "rocker", (p.coupler, 0.0, 0.0), (p.rocker, 0.0, 0.0))
    for relation in relations(p):
        b.mesh(relation)
    b.shaft("coupler_angle", {"crank_angle": 1, "coupler_joint": 1})
    b.shaft("idler_angle", {"crank_angle": 1, "coupler_joint": 1, "idler_joint": 1},
            zero=float(at.idler_angle) - (psi + idler))  # fmt: skip
    if p.load_inertia:
        b.shaft("load", {"output_angle": 1}, inertia=p.load_inertia, zero=out - turned)
    b.frame("B", "crank", (p.crank, 0.0, 0.0)).frame("C", "rocker", (p.rocker, 0.0, 0.0))
    b.frame("rim", "output", (rd, 0.0, 0.0))
    b.drive("crank_angle", stiffness=200.0, damping=20.0)
    b.ground(*ground_looks(g))
    guess = {
        "crank_angle": START, "coupler_joint": psi - START, "idler_joint": idler, "rocker_angle": chi, "output_angle": turned,
    }  # fmt: skip
    return b.assemble(guess, hold=["crank_angle"])


def relations(p: Parameters) -> tuple[LinearRelation, LinearRelation]:
    """Both meshes, exact. Idler on the coupler: idler_joint = (ra / rc) coupler_joint (gear a stands in the crank, so
    seen from the coupler it turns back by coupler_joint). Output on the rocker, idler seen absolutely:
    output + (rc / rd) idler = (1 + rc / rd) rocker."""
    coupler, rocker, rc = (as_fraction(x, "gear_linkage") for x in (p.coupler, p.rocker, p.idler_radius))
    ra, rd = coupler - rc, rocker - rc
    one = Fraction(1)
    first = (("idler_joint", one), ("coupler_joint", -ra / rc))
    turn = rc / rd
    second = (
        ("output_angle", one), ("crank_angle", turn), ("coupler_joint", turn), ("idler_joint", turn),
        ("rocker_angle", -(1 + turn)),
    )  # fmt: skip
    return LinearRelation("mesh_a_idler", first, "external"), LinearRelation("mesh_idler_output", second, "external")


def _disc(p: Parameters, radius: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Inertia:
    mass, moment = p.masses.disc(radius)
    return Inertia.axial(mass, moment, 0.5 * moment, com=at)


def _phases(
    teeth: tuple[int, int, int], links: tuple[float, float, float], gears: tuple[float, float]
) -> tuple[float, float, float]:
    """Phase of each gear in its own frame, so that teeth stand in gaps in the reference pose, and so always.

    links: angles of crank, coupler and rocker; gears: angles at which the frames of idler and output stand.
    """
    a, c, d = teeth
    phi, psi, chi = links
    idler = external_phase(a, phi, c, psi)  # gear a has phase 0 in the crank, which stands at phi
    output = external_phase(c, idler, d, chi + math.pi)
    return 0.0, idler - gears[0], output - gears[1]


STIFFNESS = 30.0
"""Frequency of the crank servo in units of the crank speed."""
STEPS = 6283
"""Steps a turn: 1 ms at 1 rad/s."""
DRIVEN = ("output_held",)


def _turn(p: Parameters) -> float:
    """Duration of one crank turn [s]; 1 s for a crank at rest."""
    return 2.0 * math.pi / abs(p.speed) if p.speed else 1.0


def servo(p: Parameters) -> Servo:
    """A critically damped servo, its gains from the reduced inertia at the reference pose and the speed."""
    inertia = float(closed_form.reduced_inertia(p.linkage, p.masses, START)[0])
    w = STIFFNESS * max(abs(p.speed), 1e-3)
    return Servo("crank_angle", Ramp(0.0, p.speed), stiffness=inertia * w**2, damping=2.0 * inertia * w)


def _scene(name: str, p: Parameters, fidelity: str, laws: tuple[Law, ...], turns: float, settings: Settings) -> Scene:
    return Scene(
        name, fidelity, turns * _turn(p), laws, {"crank_angle": 0.0}, {"crank_angle": p.speed}, channels=DRIVEN,
        tolerance=1e-4, settings=settings, keep_mode=("crank_angle",),
    )  # fmt: skip


def constant_crank(p: Parameters, fidelity: str) -> Scene:
    """A servo turns the crank once at constant speed, against the drag on the output and the cutter, if there are any."""
    laws = (servo(p), *load_laws(p.linkage, p.load_drag, p.cut_torque))
    return _scene("constant-crank", p, fidelity, laws, 1.0, Settings(timestep=_turn(p) / STEPS))


def free_spin(p: Parameters, fidelity: str) -> Scene:
    """The crank is released at full speed, for about one turn."""
    return replace(_scene("free-spin", p, fidelity, (), 1.0, Settings(timestep=_turn(p) / STEPS)), drives="free")


def near_change_point(p: Parameters, fidelity: str) -> Scene:
    """As constant-crank, with a first-order integrator and a coarse step: two turns close past a change point."""
    settings = Settings(integrator="discrete", timestep=_turn(p) / STEPS)
    return _scene("near-change-point", p, fidelity, (servo(p),), 2.0, settings)


TEXTS = {
    "knife-drive": "knives of a three-knife paper cutter: one output turn a cycle with an instantaneous stop, no clutch",
    "sheet-delivery": "sheet-delivery transporter: speed matched where the sheet is gripped, slow where laid down, with sheet and drag",
    "glue-and-cut": "glue and cut: the play of the gears makes a stop in which the strip is cut, with rollers, drag and cutter",
}
SCENES = {
    "constant-crank": SceneRecipe(constant_crank, "minimal", "a servo turns the crank once at constant speed"),
    "free-spin": SceneRecipe(free_spin, "minimal", "the crank is let go at full speed"),
    "near-change-point": SceneRecipe(
        near_change_point,
        "minimal",
        "two turns of a crank 1e-5 short of the change point: with a coarse step the run stops instead of flipping",
        NEAR_CHANGE_POINT,
    ),
} | {name: SceneRecipe(constant_crank, "minimal", TEXTS[name], changes) for name, changes in PRESETS.items()}


def reference(p: Parameters, scene: Scene, method: str = "DOP853", tolerance: float = 1e-12) -> Recording:
    """Own equation of the one freedom (Eksergian), integrated by DOP853 to 1e-12."""
    m = build(p, "minimal")
    drag = sum(law.coefficient for law in scene.laws if isinstance(law, Viscous))

    g, masses = p.linkage, p.masses

    def acceleration(phi: float, w: float, torque: float) -> float:
        return float(closed_form.acceleration(g, masses, phi, w, torque, drag))

    slope = one_freedom_slope(m, scene, "crank_angle", acceleration)
    start = np.array([scene.initial["crank_angle"], scene.initial_rates["crank_angle"]])
    return record_own(m, scene, slope, start, lambda y: coordinates(p, m, y[:, 0], y[:, 1]), method, tolerance)


def coordinates(p: Parameters, m: Mechanism, phi: Array, w: Array) -> tuple[Array, Array]:
    """(n, nq), (n, nv) coordinates and rates of the model along crank angles and rates, from the closed form."""
    x = closed_form.motion(p.linkage, phi, w)
    at = closed_form.motion(p.linkage, START)
    idler = x.idler_angle - at.idler_angle - (x.coupler_angle - at.coupler_angle)
    values = {
        "crank_angle": phi - START, "coupler_joint": x.coupler_angle - at.coupler_angle - (phi - START),
        "idler_joint": idler, "rocker_angle": x.rocker_angle - at.rocker_angle,
        "output_angle": x.output_angle - at.output_angle,
    }  # fmt: skip
    rates = {
        "crank_angle": w, "coupler_joint": x.coupler_rate - w, "idler_joint": x.idler_rate - x.coupler_rate,
        "rocker_angle": x.rocker_rate, "output_angle": x.output_rate,
    }  # fmt: skip
    names = [j.name for j in m.joints]
    return np.column_stack([values[n] for n in names]), np.column_stack([rates[n] for n in names])


def output_held(p: Parameters, recording: Recording) -> Array:
    """(n,) output angle [rad] with the play `backlash`: the gears push it, friction holds it while they do not."""
    return closed_form.with_play(recording.channel("output_angle"), p.backlash)
