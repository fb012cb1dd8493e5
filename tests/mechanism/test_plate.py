"""Plates through several pins: area, centre and inertia against integrals and against the mesh that is drawn."""

import math

import numpy as np
import pytest
import trimesh
from scipy.integrate import quad

import mechlab as ml
from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import Array, frame_along
from mechlab.mechanism.plate import convex_hull, plate_area, plate_inertia, plate_outline
from mechlab.shapes import mesh

PINS = {
    "two": [(0.0, 0.0), (0.3, 0.1)],
    "triangle": [(0.0, 0.0), (0.4, 0.05), (0.1, 0.3)],
    "one inside": [(0.0, 0.0), (0.4, 0.0), (0.2, 0.1), (0.25, 0.4), (-0.1, 0.3)],
    "on a line": [(0.0, 0.0), (0.2, 0.2), (0.1, 0.1)],
}


def distance(p: Array, a: Array, b: Array) -> float:
    t = float(np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0))
    return float(np.linalg.norm(p - a - t * (b - a)))


def chord(x: float, pins: Array, radius: float) -> tuple[float, float]:
    """Lowest and highest y of the plate at x: the envelope of the discs round all points of all lines between pins."""
    low, high = math.inf, -math.inf
    for a in pins:
        for b in pins:
            # the top of the strip round a-b at x: the largest y of a + t (b - a) + radius (cos, sin) with that x
            cx, cy = (a + np.linspace(0.0, 1.0, 4001)[:, None] * (b - a)).T
            near = np.abs(x - cx) <= radius
            rise = np.sqrt(radius**2 - (x - cx[near]) ** 2)
            low, high = np.min(cy[near] - rise, initial=low), np.max(cy[near] + rise, initial=high)
    return low, high


def test_area_and_moments_against_an_integral_over_chords() -> None:
    pins, r = np.array(PINS["triangle"]), 0.04
    x = np.linspace(pins[:, 0].min() - r, pins[:, 0].max() + r, 241)
    low, high = np.array([chord(v, pins, r) for v in x]).T
    low[[0, -1]], high[[0, -1]] = 0.0, 0.0  # the ends are points

    def integral(values: Array) -> float:
        return float(np.trapezoid(values, x))

    found = plate_area(pins, r)
    # trapezoids of a curve with upright ends: error of order h^1.5
    assert found.area == pytest.approx(integral(high - low), rel=2e-3)
    assert found.first[1] == pytest.approx(integral((high**2 - low**2) / 2), rel=3e-3)
    assert found.second[0, 0] == pytest.approx(integral(x**2 * (high - low)), rel=3e-3)
    assert found.second[0, 1] == pytest.approx(integral(x * (high**2 - low**2) / 2), rel=3e-3)
    assert found.second[1, 1] == pytest.approx(integral((high**3 - low**3) / 3), rel=3e-3)


def test_a_stadium_by_hand() -> None:
    r, half = 0.1, 0.25
    found = plate_area([(-half, 0.0), (half, 0.0)], r)
    assert found.area == pytest.approx(math.pi * r**2 + 4 * half * r, rel=1e-14)
    disc, _ = quad(lambda y: 2 * y**2 * math.sqrt(r**2 - y**2), -r, r)
    assert found.central[1, 1] == pytest.approx(disc + 2 * half * (2 * r) ** 3 / 12, rel=1e-9)
    assert found.centre == pytest.approx([0.0, 0.0], abs=1e-15)


@pytest.mark.parametrize("pins", PINS.values(), ids=PINS)
def test_inertia_against_trimesh(pins: list[tuple[float, float]]) -> None:
    r, thickness, mass = 0.03, 0.012, 1.7
    from mechlab.shapes.build import extrude

    errors = []
    for segments in (200, 400):
        solid = extrude(plate_outline(pins, r, segments), (), -thickness / 2, thickness / 2)
        body = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
        body.density = mass / body.volume
        got = plate_inertia(pins, r, thickness, mass)
        errors.append(float(np.abs(got.matrix() - body.moment_inertia).max() / np.abs(body.moment_inertia).max()))
        np.testing.assert_allclose(got.com, body.center_mass, atol=1e-4)
    # polygons approach a circle with the square of their number of sides
    assert errors[1] < 1e-4 and errors[1] < 0.3 * errors[0]


def test_the_hull_keeps_its_corners_only() -> None:
    assert convex_hull(PINS["one inside"]).tolist() == [[-0.1, 0.3], [0.0, 0.0], [0.4, 0.0], [0.25, 0.4]]
    assert convex_hull(PINS["on a line"]).tolist() == [[0.0, 0.0], [0.2, 0.2]]


def test_every_point_of_the_outline_is_as_far_as_the_radius() -> None:
    hull = convex_hull(PINS["one inside"])
    sides = list(zip(hull, np.roll(hull, -1, axis=0), strict=True))
    for p in plate_outline(PINS["one inside"], 0.03):
        assert min(distance(p, a, b) for a, b in sides) == pytest.approx(0.03, abs=1e-12)


def test_a_ternary_link_in_a_mechanism() -> None:
    b = ml.Builder("ternary").plate("rocker", ml.revolute("turn"), [("300mm", 0), (0.1, 0.2)], mass=2, thickness="10mm")
    m = b.frame("tip", "rocker", (0.1, 0.2, 0)).build()
    drawn = mesh(m.body("rocker").shapes[0].kind, m.body("rocker").shapes[0].parameters)
    width = 0.12 * 0.3
    assert np.ptp(drawn.vertices, axis=0) == pytest.approx([0.3 + width, 0.2 + width, 0.01], rel=3e-3)
    pin = 0.18 * width
    expected = plate_area([(0, 0), (0.3, 0), (0.1, 0.2)], width / 2).area * 0.01 - 3 * math.pi * pin**2 * 0.01
    solid = trimesh.Trimesh(drawn.vertices, drawn.faces, process=False)
    assert solid.is_watertight and solid.volume == pytest.approx(expected, rel=3e-3)  # circles are polygons
    assert m.total_mass == 2.0


def test_density_and_an_axis_that_is_not_z() -> None:
    flat = ml.Builder("a").plate("p", ml.revolute("j"), [(0.3, 0), (0.1, 0.2)], density=7850, thickness=0.01).build()
    area = plate_area([(0, 0), (0.3, 0), (0.1, 0.2)], 0.018).area
    assert flat.total_mass == pytest.approx(area * 0.01 * 7850, rel=1e-14)
    turn = frame_along((1.0, 0.0, 0.0))
    points = [tuple(turn @ np.array(p)) for p in [(0.3, 0.0, 0.0), (0.1, 0.2, 0.0)]]
    tilted = ml.Builder("a").plate("p", ml.revolute("j", "x"), points, density=7850, thickness=0.01).build()
    want = turn @ flat.body("p").inertia.matrix() @ turn.T
    np.testing.assert_allclose(tilted.body("p").inertia.matrix(), want, atol=1e-15)


@pytest.mark.parametrize(
    ("points", "options", "words"),
    [
        ([(0.3, 0), (0.3, 0)], {}, "points 1 and 2 are closer than the bores"),
        ([(0.3, 0), (0, 0)], {}, "points 0 and 2 are closer"),
        ([(0.3, 0, 0.1)], {}, "point 1 lies 0.1 m off the plane"),
        ([], {}, "expected 1 to 11 points"),
        ([(0.3, "5kg")], {}, r"point 1: expected a number \[m\], got '5kg'"),
        ([(0.3, 0, 0, 0)], {}, "expected three numbers"),
        ([(0.3, 0)], {"mass": 1, "density": 2}, "its mass or its density, not both"),
        ([(0.3, 0)], {"width": -1}, "width must be positive, got -1 m"),
    ],
)
def test_a_plate_that_cannot_be_is_named(
    points: list[tuple[float, ...]], options: dict[str, float], words: str
) -> None:
    with pytest.raises(MechlabError, match=words):
        ml.Builder("a").plate("p", ml.revolute("j"), points, **options)
