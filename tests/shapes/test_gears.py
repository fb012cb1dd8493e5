"""Gears are real: involute flanks, and pairs that turn through each other's gaps without touching.

Outline corners lie on the true profile, so an outline errs only by the sagitta of its chords: for an involute between
roll angles a step apart, h = rb roll step^2 / 8. Outside teeth are never too thick, inside teeth by at most h.
"""

import math

import numpy as np
import pytest

from mechlab import shapes
from mechlab.errors import MechlabError
from mechlab.shapes.bevel import back_cone_outline
from mechlab.shapes.involute import Teeth, internal_outline, rack_outline, ring_tooth, spur_outline, tooth

ALPHA = math.radians(20.0)
EXTERNAL = [(6, 80), (8, 8), (12, 12), (12, 36), (18, 36), (20, 20), (17, 101)]
INTERNAL = [(20, 60), (12, 36), (18, 54), (16, 80), (30, 40), (8, 40)]
BEVEL = [(20, 20, 90.0), (16, 32, 90.0), (12, 36, 90.0), (20, 30, 60.0), (20, 30, 110.0), (10, 14, 90.0)]


def inside(points: np.ndarray, outline: np.ndarray) -> np.ndarray:
    a, b = outline, np.roll(outline, -1, axis=0)
    x, y = points[:, 0, None], points[:, 1, None]
    rise = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
    left = ((a[:, 1] > y) != (b[:, 1] > y)) & (x < (b[:, 0] - a[:, 0]) * (y - a[:, 1]) / rise + a[:, 0])
    return left.sum(axis=1) % 2 == 1


def distance(points: np.ndarray, outline: np.ndarray) -> np.ndarray:
    along = np.roll(outline, -1, axis=0) - outline
    offset = points[:, None] - outline
    t = np.clip((offset * along).sum(axis=2) / (along * along).sum(axis=1), 0.0, 1.0)
    return np.linalg.norm(offset - t[:, :, None] * along, axis=2).min(axis=1)


def depth(points: np.ndarray, outline: np.ndarray, hollow: bool = False) -> float:
    """How deep points stand in the material inside an outline (or around it, when hollow)."""
    bad = inside(points, outline) != hollow
    return float(distance(points[bad], outline).max()) if bad.any() else 0.0


def dense(outline: np.ndarray, pieces: int = 3) -> np.ndarray:
    step = np.roll(outline, -1, axis=0) - outline
    return np.stack([outline + step * k / pieces for k in range(pieces)], axis=1).reshape(-1, outline.shape[1])


def near(points: np.ndarray, center: np.ndarray) -> np.ndarray:
    return points[np.linalg.norm(points - center, axis=1) < 4.0]


def placed(outline: np.ndarray, phase: float, center: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    c, s = math.cos(phase), math.sin(phase)
    return outline @ np.array([[c, s], [-s, c]]) + np.array(center)


def direction(angle: float) -> np.ndarray:
    return np.array([math.cos(angle), math.sin(angle)])


def external_overlap(za: int, zb: int, backlash: float, extra: float = 0.0, psi: float = 0.7) -> float:
    a, b = (spur_outline(Teeth(z, 1.0, ALPHA, backlash)) for z in (za, zb))
    pitch_point, center = 0.5 * za * direction(psi), 0.5 * (za + zb) * direction(psi)
    worst = 0.0
    for turn in np.linspace(0.0, 2.0 * math.pi / za, 17):
        phase = shapes.external_phase(za, 0.3 + turn, zb, psi)
        one, two = placed(a, 0.3 + turn), placed(b, phase + extra * 2.0 / zb, center)
        worst = max(worst, depth(near(dense(one), pitch_point), two), depth(near(dense(two), pitch_point), one))
    return worst


def internal_overlap(zp: int, zr: int, backlash: float, extra: float = 0.0, psi: float = 0.7) -> float:
    pinion = spur_outline(Teeth(zp, 1.0, ALPHA, backlash))
    ring = internal_outline(Teeth(zr, 1.0, ALPHA, backlash))
    center = 0.5 * (zr - zp) * direction(psi)
    worst = 0.0
    for turn in np.linspace(0.0, 2.0 * math.pi / zp, 17):
        phase = shapes.internal_phase(zp, 0.3 + turn, zr, psi)
        one, two = placed(pinion, 0.3 + turn, center), placed(ring, phase + extra * 2.0 / zr)
        worst = max(worst, depth(dense(one), two, hollow=True), depth(dense(two), one))
    return worst


def bevel_overlap(za: int, zb: int, shaft: float, backlash: float, extra: float = 0.0) -> float:
    """Overlap along the sphere round the apex, where straight bevel teeth are plane figures of directions."""

    def about_z(t: float) -> np.ndarray:
        return np.array([[math.cos(t), -math.sin(t), 0.0], [math.sin(t), math.cos(t), 0.0], [0.0, 0.0, 1.0]])

    def polar(p: np.ndarray) -> np.ndarray:
        flat = np.hypot(p[:, 0], p[:, 1])
        return p[:, :2] / flat[:, None] * np.arctan2(flat, p[:, 2])[:, None]

    delta_a, delta_b = shapes.pitch_angles(za, zb, shaft)
    reach = 0.5 * za / math.sin(delta_a)
    tilt = np.roll(np.roll(about_z(shaft), 1, axis=0), 1, axis=1)  # about x
    frame_a = about_z(0.4)
    frame_b = frame_a @ about_z(1.1) @ tilt @ about_z(0.7)
    contact = (math.sin(delta_b) * frame_a[:, 2] + math.sin(delta_a) * frame_b[:, 2]) / math.sin(shaft)
    outlines = [dense(back_cone_outline(Teeth(z, 1.0, ALPHA, backlash), d)) for z, d in ((za, delta_a), (zb, delta_b))]
    flat_a, flat_b = polar(outlines[0]), polar(outlines[1])
    worst = 0.0
    for turn in np.linspace(0.0, 2.0 * math.pi / za, 17):
        phase = shapes.bevel_phase(za, turn, frame_a, zb, frame_b) + extra * 2.0 / zb
        turned_a, turned_b = frame_a @ about_z(turn), frame_b @ about_z(phase)
        a, b = outlines[0] @ turned_a.T, outlines[1] @ turned_b.T
        close_a, close_b = (p @ contact > math.cos(4.0 / reach) * np.linalg.norm(p, axis=1) for p in (a, b))
        worst = max(worst, depth(polar(a[close_a] @ turned_b), flat_b), depth(polar(b[close_b] @ turned_a), flat_a))
    return worst * reach


@pytest.mark.parametrize("number", [6, 8, 12, 17, 20, 30, 46, 80, 200])
def test_flanks_are_involutes(number: int) -> None:
    teeth = Teeth(number, 0.003, ALPHA, 1e-4)
    radii, halves = tooth(teeth)
    at = np.flatnonzero(radii == teeth.pitch)
    assert len(at) == 1  # the pitch point is a corner of the outline: the thickness there has no chord error
    assert 2.0 * halves[at[0]] * teeth.pitch == pytest.approx(0.5 * math.pi * 0.003 - 1e-4, rel=1e-12)
    # involute property: the normal at every corner touches the base circle, so the line of action is straight
    for r in radii[radii > max(teeth.form, teeth.base * 1.001)]:
        step = 1e-6 * r
        slope = float(teeth.flank(np.array(r + step)) - teeth.flank(np.array(r - step))) / (2.0 * step)
        arm = r * abs(r * slope) / math.hypot(1.0, r * slope)  # distance of the flank's normal from the centre
        assert math.hypot(arm, teeth.base) == pytest.approx(r, rel=1e-6)
    # and the root that the rack cuts meets them without a step
    form = np.array(teeth.form)
    assert float(teeth.fillet(form)) == pytest.approx(float(teeth.flank(form)), abs=1e-12)
    assert (halves > 0.0).all()


@pytest.mark.parametrize("number", [9, 17, 30, 80])
def test_chords_keep_the_stated_tolerance(number: int) -> None:
    teeth = Teeth(number, 1.0)
    outline = spur_outline(teeth)
    r = np.linspace(teeth.form, teeth.tip, 400)
    half = teeth.flank(np.maximum(r, teeth.base))
    flank = np.column_stack([r * np.cos(half), r * np.sin(half)])
    radii, _ = tooth(teeth)
    roll = np.sqrt(np.maximum((radii[radii >= teeth.form - 1e-12] / teeth.base) ** 2 - 1.0, 0.0))
    bound = float(np.max(teeth.base * roll[1:] * np.diff(roll) ** 2 / 8.0))
    assert distance(flank, outline).max() <= 1.05 * bound
    assert bound < 0.025  # of a module, less than the default backlash


def test_a_sharp_rack_undercuts_below_22_teeth() -> None:
    limit = 2.0 * 1.25 / math.sin(ALPHA) ** 2  # 21.4: the corner of the rack reaches the point of tangency
    for number, tangent in ((12, False), (17, False), (math.ceil(limit), True), (40, True)):
        teeth = Teeth(number, 1.0)
        slope = [np.gradient(f(teeth.form + np.array([0.0, 1e-6])), 1e-6)[0] for f in (teeth.fillet, teeth.flank)]
        assert bool(abs(slope[0] - slope[1]) < 1e-3) is tangent
    radii, halves = tooth(Teeth(8, 1.0))
    assert halves[np.searchsorted(radii, Teeth(8, 1.0).base)] < halves.max()  # a waist at the foot of the tooth
    shifted = Teeth(8, 1.0, shift=17 * 0.5 * math.sin(ALPHA) ** 2 * 0.6)
    assert shifted.form - shifted.base < Teeth(8, 1.0).form - Teeth(8, 1.0).base


@pytest.mark.parametrize(("za", "zb"), EXTERNAL)
def test_external_pairs_do_not_overlap(za: int, zb: int) -> None:
    assert external_overlap(za, zb, 0.04) == 0.0
    assert external_overlap(za, zb, 0.0) < 1e-3  # of a module, without any backlash


@pytest.mark.parametrize(("zp", "zr"), INTERNAL)
def test_internal_pairs_do_not_overlap(zp: int, zr: int) -> None:
    assert internal_overlap(zp, zr, 0.04) == 0.0
    radii, _ = ring_tooth(Teeth(zr, 1.0))
    base = Teeth(zr, 1.0).base
    roll = np.sort(np.sqrt((radii / base) ** 2 - 1.0))
    bound = float(np.max(base * roll[1:] * np.diff(roll) ** 2 / 8.0))
    assert internal_overlap(zp, zr, 0.0) < bound + 1e-3 < 0.012


@pytest.mark.parametrize(("za", "zb", "shaft"), BEVEL)
def test_bevel_pairs_do_not_overlap(za: int, zb: int, shaft: float) -> None:
    assert bevel_overlap(za, zb, math.radians(shaft), 0.04) == 0.0
    assert bevel_overlap(za, zb, math.radians(shaft), 0.0) < 2e-3


@pytest.mark.parametrize("extra", [-0.05, 0.05])
def test_the_overlap_check_would_see_a_wrong_phase(extra: float) -> None:
    """Without backlash a phase wrong by 0.05 modules drives the flanks into each other by about 0.05 cos(alpha)."""
    assert external_overlap(18, 36, 0.0, extra) > 0.03
    assert internal_overlap(20, 60, 0.0, extra) > 0.03
    assert bevel_overlap(16, 32, 0.5 * math.pi, 0.0, extra) > 0.03


def test_rack_and_pinion() -> None:
    pinion, bar = spur_outline(Teeth(20, 1.0, ALPHA)), rack_outline(9, 1.0, 2.0, ALPHA, 0.0, 0.0)
    for x in np.linspace(-3.0, 3.0, 13):
        phase = shapes.rack_phase(20, 1.0, float(x))
        gear = placed(pinion, phase, (float(x), 10.0))
        assert depth(dense(gear), bar) < 1e-3
        assert depth(dense(bar), gear) < 1e-3
    assert shapes.rack_phase(20, 1.0, 1.0) == pytest.approx(shapes.rack_phase(20, 1.0, 0.0) - 1.0 / 10.0)  # rolls


def test_phases_follow_the_rolling() -> None:
    pitch = 2.0 * math.pi / 30
    one, two = (shapes.external_phase(20, t, 30, 0.5) for t in (0.1, 0.13))
    assert (two - one + 0.03 * 20 / 30) / pitch == pytest.approx(round((two - one + 0.03 * 20 / 30) / pitch))
    back = shapes.external_phase(30, one, 20, 0.5 + math.pi)
    assert (back - 0.1) / (2.0 * math.pi / 20) == pytest.approx(round((back - 0.1) / (2.0 * math.pi / 20)), abs=1e-12)
    ring = shapes.internal_phase(20, 0.1, 60, 0.5)
    again = shapes.internal_phase(60, ring, 20, 0.5)
    assert (again - 0.1) / (2.0 * math.pi / 20) == pytest.approx(round((again - 0.1) / (2.0 * math.pi / 20)), abs=1e-12)


def test_a_planetary_set_fits_all_round() -> None:
    """(z_sun + z_ring) / 3 is whole: planets phased from the sun fit the ring phased from the first."""
    sun, planet, ring = 24, 18, 60
    seats = 2.0 * math.pi * np.arange(3) / 3
    planets = [shapes.external_phase(sun, 0.2, planet, float(s)) for s in seats]
    rings = [shapes.internal_phase(planet, p, ring, float(s)) for p, s in zip(planets, seats, strict=True)]
    pitch = 2.0 * math.pi / ring
    off = (np.array(rings) - rings[0]) / pitch
    assert np.allclose(off, np.round(off), atol=1e-9)


def test_phase_survives_a_turning_carrier() -> None:
    """A planet on a carrier that has turned by c, its sun held, stands where the phase for its new place says."""
    sun, planet, c = 24, 18, 0.37
    start = shapes.external_phase(sun, 0.2, planet, 0.5)
    rolled = start + c * (1.0 + sun / planet)
    expected = shapes.external_phase(sun, 0.2, planet, 0.5 + c)
    pitches = (rolled - expected) / (2.0 * math.pi / planet)
    assert pitches == pytest.approx(round(pitches), abs=1e-9)


def test_phase_zero_centres_a_tooth_on_x() -> None:
    for kind, extra in (("spur_gear", {}), ("bevel_gear", {"pitch_angle": 0.7})):
        size = {"teeth": 16, "module": 0.004, "width": 0.01, **extra}
        v = shapes.mesh(kind, size).vertices
        radius = np.hypot(v[:, 0], v[:, 1])
        tips = v[radius > radius.max() - 1e-9]
        angles = np.arctan2(tips[:, 1], tips[:, 0])
        first = angles[np.abs(angles) < math.pi / 16]
        assert len(first) and abs(first.mean()) < 1e-12
    v = shapes.mesh("internal_gear", {"teeth": 40, "module": 0.002, "width": 0.01}).vertices
    radius = np.hypot(v[:, 0], v[:, 1])
    tips = v[radius < radius.min() + 1e-9]
    angles = np.arctan2(tips[:, 1], tips[:, 0])
    assert abs(angles[np.abs(angles) < math.pi / 40].mean()) < 1e-12


def test_bevel_teeth_meet_in_the_apex() -> None:
    size = {"teeth": 20, "module": 0.004, "pitch_angle": 0.8, "width": 0.02}
    teeth = Teeth(20, 0.004, ALPHA, 0.04 * 0.004)
    outline = back_cone_outline(teeth, 0.8)
    distance_to_apex = teeth.pitch / math.sin(0.8)
    shrink = 1.0 - 0.02 / distance_to_apex
    vertices = shapes.mesh("bevel_gear", size).vertices
    assert np.allclose(vertices[: len(outline)], outline)
    assert np.allclose(vertices[len(outline) : 2 * len(outline)], outline * shrink)
    pitch_ring = outline[np.isclose(np.hypot(outline[:, 0], outline[:, 1]), teeth.pitch, rtol=1e-12)]
    assert len(pitch_ring) == 2 * 20
    assert np.allclose(np.linalg.norm(pitch_ring, axis=1), distance_to_apex)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Teeth(20, 1.0, 1.0), "pressure_angle"),
        (lambda: Teeth(20, 1.0, ALPHA, 0.6), "backlash"),
        (lambda: Teeth(20, 1.0, ALPHA, 0.0, 2.0), "profile_shift"),
        (lambda: shapes.bevel_phase(20, 0.0, np.eye(3), 30, np.eye(3)), "parallel"),
    ],
)
def test_impossible_teeth_are_refused(make: object, words: str) -> None:
    assert callable(make)
    with pytest.raises(MechlabError, match=words):
        make()
