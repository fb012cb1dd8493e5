"""The three mechanisms of the delta: `minimal`, `parts` and `full`.

Every body frame stands parallel to the base frame in the home pose (platform centre O at the origin), so that all
placements are pure translations and every loop is closed bit for bit.

Sense of the gears: the meshes N-Pr and Pr-planet are external, so drives 1 and 2 and the planets turn about -Z and
phi = K (alpha, beta, gamma) has the signs of the source. The double bevel Pz1 turns about -Y, Pz2 about +Y.
"""

from __future__ import annotations

from functools import lru_cache

from mechlab.catalog.delta6 import appearance, masses
from mechlab.catalog.delta6.masses import BEVEL_OFFSET, PLANET_OFFSET, vec
from mechlab.catalog.delta6.parameters import CENTRE, ROTARY, SLIDERS, Delta6Parameters, Leg, legs
from mechlab.errors import unknown
from mechlab.mechanism import Builder, Inertia, Mechanism, floating, prismatic, revolute, spherical
from mechlab.mechanism.gears import mimic
from mechlab.mechanism.geometry import cross, unit

SERVOS = dict.fromkeys(SLIDERS, (2e5, 1.5e3)) | dict.fromkeys(ROTARY, (200.0, 4.0))
"""Stiffness and damping of the position servos in the files: sliders [N/m, N s/m], shafts [N m/rad, N m s/rad]."""
SUMMARY = "6-DOF delta: three sliders, six rods with cardan shafts, gear train and bevel head"


@lru_cache(maxsize=32)
def build(p: Delta6Parameters, fidelity: str) -> Mechanism:
    """The delta at a fidelity: minimal (15 coordinates, 9 rows), parts (18, 12) or full (45, 36)."""
    makers = {"minimal": _minimal, "parts": _parts, "full": _full}
    if fidelity not in makers:
        raise unknown("delta6: fidelity", fidelity, makers)
    b = Builder("delta6", summary=SUMMARY)
    b.ground(*appearance.ground(p))
    makers[fidelity](b, p)
    _points(b, p)
    for name, servo in SERVOS.items():
        b.drive(name, *servo)
    return b.build()


def _points(b: Builder, p: Delta6Parameters) -> None:
    """The points O and D, and the idler between shaft 3 and the carrier."""
    place = appearance.idler_placement(p)
    b.shaft("idler", {"gamma": -1}, body="platform", placement=place, shapes=appearance.idler(p))
    b.frame("O", "platform")
    b.frame("D", "output", at=(p.head_offset, 0.0, 0.0))


def _slider(b: Builder, p: Delta6Parameters, leg: Leg, inertia: Inertia) -> None:
    joint = prismatic(SLIDERS[leg.index - 1], "z", zero=leg.home + p.slider_height, range=(p.slider_min, p.slider_max))
    b.body(f"slider_{leg.index}", joint, at=vec(leg.upper), inertia=inertia, shapes=appearance.slider(p, leg))


def _sense(i: int) -> str:
    """Axis of the positive sense of rotary drive i."""
    return "-z" if i < 3 else "z"


def _with_lower_ends(p: Delta6Parameters) -> Inertia:
    """The platform with the three lower crosses and shaft stubs."""
    total = masses.platform(p)
    for leg in legs(p):
        total = total + (masses.STUB + masses.cross(p)).at(vec(leg.lower))
    return total


def _sliding_platform(b: Builder, p: Delta6Parameters, inertia: Inertia) -> None:
    joints = (prismatic(name, axis) for name, axis in zip(CENTRE, "xyz", strict=True))
    b.body("platform", *joints, inertia=inertia, shapes=appearance.platform(p))


def _head(b: Builder, p: Delta6Parameters, carrier: Inertia, tee: Inertia) -> None:
    b.body("carrier", revolute("gamma", "z"), parent="platform", inertia=carrier, shapes=appearance.carrier(p))
    b.body("tee", revolute("beta", "y"), parent="carrier", inertia=tee, shapes=appearance.tee(p))
    b.body("output", revolute("alpha", "x"), parent="tee", inertia=masses.output(p), shapes=appearance.output(p))


def _gears(b: Builder, p: Delta6Parameters, shafts: tuple[str, str, str]) -> None:
    """Central gears, planets and double bevels as bodies, and the nine relations of the train from the lower shafts."""
    kp = p.k_transfer / p.k_spur
    for i, side in ((1, 1.0), (2, -1.0)):
        planet, axis = (0.0, side * PLANET_OFFSET, 0.0), "-y" if i == 1 else "y"
        bevel = masses.BEVEL.at((0.0, side * BEVEL_OFFSET, 0.0))
        b.body(
            f"central_{i}", revolute(f"rho{i}", "z"), parent="platform", inertia=masses.CENTRAL,
            shapes=appearance.central(p, i),
        )  # fmt: skip
        b.body(
            f"planet_{i}", revolute(f"nu{i}", "-z"), parent="carrier", at=planet, inertia=masses.PLANET,
            shapes=appearance.planet(p, i),
        )  # fmt: skip
        b.body(f"bevel_{i}", revolute(f"p{i}", axis), parent="tee", inertia=bevel, shapes=appearance.bevel(p, i))
    for i, shaft in zip((1, 2), shafts, strict=False):
        b.gears(f"N{i}_Pr{i}", shaft, f"rho{i}", (1, p.k_spur), carrier="platform")
        b.gears(f"Pr{i}_planet{i}", f"rho{i}", f"nu{i}", (1, kp), carrier="carrier")
        b.gears(f"Nz{i}_Pz{i}", f"nu{i}", f"p{i}", (1, 1), carrier="carrier", kind="bevel", side=-1)
        b.gears(f"Pz{i}_VZ", f"p{i}", "alpha", (1, p.k_bevel), carrier="tee", kind="bevel", side=-1)
    b.mesh(mimic("shaft3_carrier", shafts[2], "gamma", 1))


def _minimal(b: Builder, p: Delta6Parameters) -> None:
    """Rods of a leg as one slender body on two revolutes; gears and rotors as shafts."""
    upper = masses.slider(p) + masses.STUB + masses.cross(p)
    for leg in legs(p):
        i = leg.index
        _slider(b, p, leg, upper)
        across = unit(cross(leg.span, leg.fork_b), "cross pin")
        b.body(
            f"rod_{i}", revolute(f"swing{i}", vec(leg.fork_b)), revolute(f"sway{i}", across), parent=f"slider_{i}",
            inertia=masses.rod(p, leg, count=2), shapes=appearance.rods(p, leg),
        )  # fmt: skip
        b.loop(f"ankle{i}", f"rod_{i}", "platform", vec(leg.span), vec(leg.lower))
    carried = _with_lower_ends(p) + masses.CENTRAL + masses.CENTRAL
    for leg in legs(p):
        carried = carried + masses.SPUR.at(vec(leg.lower))
    _sliding_platform(b, p, carried)
    carrier, tee = masses.CARRIER, masses.TEE
    for side in (1.0, -1.0):
        carrier = carrier + masses.without_axial(masses.PLANET, 2).at((0.0, side * PLANET_OFFSET, 0.0))
        tee = tee + masses.without_axial(masses.BEVEL, 1).at((0.0, side * BEVEL_OFFSET, 0.0))
    _head(b, p, carrier, tee)
    _shafts(b, p)


def _shafts(b: Builder, p: Delta6Parameters) -> None:
    """Drives and gears as shafts over alpha, beta, gamma: the rows of K, and the absolute spin of each gear."""
    kx, kp = p.k_transfer * p.k_bevel, p.k_transfer / p.k_spur
    spin = p.rotor_inertia + masses.shaft_spin(p) + masses.SPUR.tensor[2]
    rows: dict[int, dict[str, object]] = {
        1: {"gamma": p.k_spur, "beta": -p.k_transfer, "alpha": kx},
        2: {"gamma": p.k_spur, "beta": p.k_transfer, "alpha": kx},
        3: {"gamma": 1},
    }
    for leg in legs(p):
        i = leg.index
        b.shaft(
            f"phi{i}", rows[i], inertia=spin, body="platform", placement=appearance.shaft_placement(leg),
            shapes=appearance.spur(p, i, in_shaft=True),
        )  # fmt: skip
    for i, sign in ((1, -1), (2, 1)):
        b.shaft(
            f"rho{i}", {"gamma": 1, "beta": sign * kp, "alpha": kp * p.k_bevel}, inertia=masses.CENTRAL.tensor[2],
            body="platform", shapes=appearance.central(p, i),
        )  # fmt: skip
        b.shaft(f"planet{i}_spin", {"gamma": 1, "beta": -sign, "alpha": -p.k_bevel}, inertia=masses.PLANET.tensor[2])
        b.shaft(f"bevel{i}_spin", {"beta": 1, "alpha": sign * p.k_bevel}, inertia=masses.BEVEL.tensor[1])


def _parts(b: Builder, p: Delta6Parameters) -> None:
    """Rods as distance loops, their mass half on each end; every gear a body, every mesh a relation."""
    half = Inertia.point(p.rod_mass)
    carried = _with_lower_ends(p)
    for leg in legs(p):
        _slider(b, p, leg, masses.slider(p) + masses.STUB + masses.cross(p) + half)
        carried = carried + half.at(vec(leg.lower))
    _sliding_platform(b, p, carried)
    for leg in legs(p):
        i, lower = leg.index, vec(leg.lower)
        b.loop(f"rod{i}", f"slider_{i}", "platform", (0.0, 0.0, 0.0), lower, kind="distance", length=p.rod_length)
        joint = revolute(f"phi{i}", _sense(i), armature=p.rotor_inertia + masses.shaft_spin(p))
        b.body(f"N{i}", joint, parent="platform", at=lower, inertia=masses.SPUR, shapes=appearance.spur(p, i))
    _head(b, p, masses.CARRIER, masses.TEE)
    _gears(b, p, ("phi1", "phi2", "phi3"))


def _full(b: Builder, p: Delta6Parameters) -> None:
    """Every rod, cross, shaft, gear and planet a body; the platform floats and is held parallel by the six rods alone.

    A lower cross is split into two halves that a fixed loop joins; a plain rod is closed by a spherical loop.
    """
    for leg in legs(p):
        _full_leg(b, p, leg)
    b.body("platform", *floating("O"), inertia=masses.platform(p), shapes=appearance.platform(p))
    _head(b, p, masses.CARRIER, masses.TEE)
    _gears(b, p, ("phi1_lower", "phi2_lower", "phi3_lower"))


def _full_leg(b: Builder, p: Delta6Parameters, leg: Leg) -> None:
    """Slider, upper stub, cross, cardan rod and half a cross; plain rod; and from the platform the lower stub with the
    other half of the cross."""
    i, span, lower = leg.index, vec(leg.span), vec(leg.lower)
    a, b_axis, beside = vec(leg.fork_a), vec(leg.fork_b), p.rod_spacing * leg.tangent
    rod, half_cross = masses.rod(p, leg), masses.cross(p, 0.5)
    _slider(b, p, leg, masses.slider(p))
    b.body(
        f"stub_{i}", revolute(f"phi{i}", _sense(i), armature=p.rotor_inertia), parent=f"slider_{i}",
        inertia=masses.STUB, shapes=appearance.stub(p, leg, upper=True),
    )  # fmt: skip
    b.body(
        f"cross_{i}", revolute(f"fork{i}_a", a), parent=f"stub_{i}", inertia=masses.cross(p),
        shapes=appearance.cross(leg),
    )  # fmt: skip
    b.body(
        f"rod_{i}", revolute(f"fork{i}_b", b_axis), parent=f"cross_{i}", inertia=rod,
        shapes=appearance.cardan_rod(p, leg),
    )  # fmt: skip
    b.body(f"ankle_{i}", revolute(f"ankle{i}_b", b_axis), parent=f"rod_{i}", at=span, inertia=half_cross)
    b.body(
        f"plain_{i}", spherical(f"ball{i}"), parent=f"slider_{i}", at=vec(beside), inertia=rod,
        shapes=appearance.plain_rod(p, leg),
    )  # fmt: skip
    b.loop(f"plain{i}", f"plain_{i}", "platform", span, vec(leg.lower + beside))
    b.body(
        f"shaft_{i}", revolute(f"phi{i}_lower", _sense(i)), parent="platform", at=lower,
        inertia=masses.STUB + masses.SPUR,
        shapes=(*appearance.stub(p, leg, upper=False), *appearance.spur(p, i)),
    )  # fmt: skip
    b.body(
        f"half_{i}", revolute(f"ankle{i}_a", a), parent=f"shaft_{i}", inertia=half_cross, shapes=appearance.cross(leg)
    )
    b.loop(f"cardan{i}", f"ankle_{i}", f"half_{i}", kind="fixed")
