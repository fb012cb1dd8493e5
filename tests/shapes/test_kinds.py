"""Every kind of solid: closed, outward, the right volume, the same every time, and plain words when it cannot be."""

import math

import numpy as np
import pytest

from mechlab import shapes
from mechlab.errors import MechlabError
from mechlab.shapes.solid import Mesh

SAMPLES: dict[str, dict[str, float]] = {
    "box": {"x": 0.1, "y": 0.06, "z": 0.04},
    "cylinder": {"radius": 0.03, "length": 0.1},
    "tube": {"outer": 0.04, "inner": 0.03, "length": 0.08},
    "sphere": {"radius": 0.04},
    "cone": {"radius": 0.03, "length": 0.08},
    "rod": {"length": 0.12, "radius": 0.01},
    "disc": {"radius": 0.05, "thickness": 0.012, "bore": 0.012, "holes": 6},
    "ring": {"outer": 0.06, "inner": 0.045, "thickness": 0.01, "holes": 8, "hole": 0.003},
    "plate": {"x": 0.12, "y": 0.08, "thickness": 0.01, "corner": 0.012, "bore": 0.02, "hole": 0.004},
    "spring": {"radius": 0.02, "wire": 0.003, "length": 0.1},
    "screw": {"radius": 0.012, "length": 0.12, "pitch": 0.006},
    "nut": {"across": 0.04, "height": 0.02, "bore": 0.012},
    "link": {"length": 0.12, "width": 0.03, "thickness": 0.01},
    "arm": {"length": 0.12, "width": 0.04, "thickness": 0.012},
    "crank": {"radius": 0.05, "width": 0.035, "thickness": 0.012},
    "bracket": {"height": 0.06, "width": 0.04, "thickness": 0.02},
    "pointer": {"length": 0.1, "width": 0.02, "thickness": 0.004},
    "slotted_link": {
        "length": 0.12, "width": 0.03, "thickness": 0.01, "bore": 0.005, "slot_low": 0.03, "slot_high": 0.09, "slot_width": 0.015,
    },
    "plate_link": {
        "points": 4, "width": 0.03, "thickness": 0.01,
        "x_1": 0.0, "y_1": 0.0, "x_2": 0.12, "y_2": 0.0, "x_3": 0.03, "y_3": 0.09, "x_4": 0.05, "y_4": 0.035,
    },
    "triangle_platform": {"radius": 0.08, "height": 0.02, "azimuth": 0.3},
    "t_carrier": {"stem": 0.08, "crossbar": 0.12, "radius": 0.008},
    "flange": {"radius": 0.04, "thickness": 0.01, "reach": 0.08},
    "cross": {"span": 0.08, "radius": 0.008},
    "fork": {"span": 0.08, "pin": 0.008},
    "ball": {"radius": 0.02, "stud_length": 0.06},
    "socket": {"radius": 0.02},
    "slider": {"x": 0.08, "y": 0.04, "length": 0.06, "holes": 2, "bore": 0.008, "spacing": 0.045},
    "guide": {"length": 0.16, "radius": 0.008, "spacing": 0.045, "foot": 0.01},
    "rail": {"length": 0.15, "width": 0.02},
    "carriage": {"length": 0.05, "width": 0.05, "height": 0.03},
    "spur_gear": {"teeth": 30, "module": 0.003, "width": 0.02, "bore": 0.008},
    "internal_gear": {"teeth": 60, "module": 0.002, "width": 0.016},
    "floor": {"x": 0.4, "y": 0.3},
    "rack": {"teeth": 8, "module": 0.004, "width": 0.02},
    "bevel_gear": {"teeth": 24, "module": 0.004, "pitch_angle": 0.9, "width": 0.022, "bore": 0.008},
    "geneva_wheel": {"slots": 6, "center": 0.1, "pin": 0.004, "thickness": 0.01, "bore": 0.006},
    "geneva_driver": {"slots": 6, "center": 0.1, "pin": 0.004, "thickness": 0.01, "bore": 0.006},
    "disc_cam": {"base": 0.04, "lift": 0.02, "rise": 2.0, "top": 0.5, "fall": 1.5, "roller": 0.01, "thickness": 0.01, "bore": 0.008},
    "oval": {"major": 0.05, "eccentricity": 0.5, "thickness": 0.01, "bore": 0.005},
}
VARIANTS: list[tuple[str, dict[str, float]]] = [
    *SAMPLES.items(),
    ("cylinder", {"radius": 0.03, "length": 0.1, "chamfer": 0.004}),
    ("cone", {"radius": 0.03, "length": 0.08, "tip": 0.01}),
    ("disc", {"radius": 0.05, "thickness": 0.012}),
    ("link", {"length": 0.12, "width": 0.03, "thickness": 0.01, "bore": 0.0}),
    ("ball", {"radius": 0.02}),
    ("slider", {"x": 0.08, "y": 0.04, "length": 0.06, "holes": 0, "corner": 0.0}),
    ("guide", {"length": 0.16, "radius": 0.008}),
    ("triangle_platform", {"radius": 0.08, "height": 0.02, "azimuth_2": 1.9, "azimuth_3": 4.4, "bore": 0.0}),
    ("spur_gear", {"teeth": 6, "module": 0.003, "width": 0.02}),
    ("spur_gear", {"teeth": 17, "module": 0.003, "width": 0.02, "profile_shift": 0.5, "phase": 1.0}),
    ("spur_gear", {"teeth": 36, "module": 0.003, "width": 0.02, "bore": 0.008, "holes": 5}),
    ("spur_gear", {"teeth": 40, "module": 0.003, "width": 0.02, "bore": 0.008, "holes": 6, "web": 0.008}),
    ("spur_gear", {"teeth": 40, "module": 0.003, "width": 0.02, "bore": 0.008, "spokes": 5, "web": 0.01}),
    ("spur_gear", {"teeth": 40, "module": 0.003, "width": 0.02, "web": 0.01}),
    ("spur_gear", {"teeth": 120, "module": 0.001, "width": 0.01, "bore": 0.008, "spokes": 6}),
    ("internal_gear", {"teeth": 30, "module": 0.002, "width": 0.016}),
    ("geneva_wheel", {"slots": 3, "center": 0.1, "pin": 0.002, "thickness": 0.01}),
    ("geneva_driver", {"slots": 16, "center": 0.1, "pin": 0.003, "thickness": 0.01}),
    ("bevel_gear", {"teeth": 12, "module": 0.004, "pitch_angle": 0.4, "width": 0.022}),
    ("bevel_gear", {"teeth": 60, "module": 0.002, "pitch_angle": 1.4, "width": 0.015, "bore": 0.01}),
]
# cross-section of one pitch of a rack over m^2: the bar 2 pi high, then the tooth from -1.25 to 1
RACK = 2.0 * math.pi + 2.25 * (0.5 * math.pi - 0.04) - math.tan(math.radians(20.0)) * (1.0 - 1.25**2)
ONCE = 48 * math.sin(2.0 * math.pi / 48) / (2.0 * math.pi)  # area of a 48-gon over that of its circle


def outwardness(mesh: Mesh) -> float:
    """Share of the face centres that leave the solid when pushed outwards: winding number by solid angles."""
    c = mesh.corners
    rng = np.random.default_rng(5)
    area = np.linalg.norm(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), axis=1)
    chosen = rng.choice(len(c), size=24, p=area / area.sum())
    step = 1e-4 * float(np.ptp(shapes.bounds(mesh), axis=0).max()) * mesh.normals[chosen]
    middle = c[chosen].mean(axis=1)
    jump = [winding(mesh, m - s) - winding(mesh, m + s) for m, s in zip(middle, step, strict=True)]
    return float(np.mean(np.abs(np.array(jump) - 1.0) < 0.05))


def winding(mesh: Mesh, point: np.ndarray) -> float:
    """How often the surface surrounds a point (Van Oosterom & Strackee 1983)."""
    a, b, c = np.moveaxis(mesh.corners - point, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    top = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
    return float(np.sum(np.arctan2(top, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)) / (2.0 * math.pi))


def test_every_kind_has_a_sample() -> None:
    assert set(SAMPLES) == set(shapes.KINDS)


@pytest.mark.parametrize(("kind", "size"), VARIANTS)
def test_closed_and_outward(kind: str, size: dict[str, float]) -> None:
    mesh = shapes.mesh(kind, size)
    assert shapes.is_watertight(mesh)
    assert shapes.volume(mesh) > 0.0
    assert outwardness(mesh) == 1.0
    c = mesh.corners
    assert np.linalg.norm(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), axis=1).min() > 0.0
    assert len(mesh.faces) < 6500


@pytest.mark.parametrize(
    ("kind", "volume", "shape_error"),
    [
        ("box", 0.1 * 0.06 * 0.04, 1e-12),
        ("cylinder", ONCE * math.pi * 0.03**2 * 0.1, 1e-12),
        ("tube", ONCE * math.pi * (0.04**2 - 0.03**2) * 0.08, 1e-12),
        ("sphere", 4.0 / 3.0 * math.pi * 0.04**3, 0.025),
        ("cone", math.pi * 0.03**2 * 0.08 / 3.0, 0.01),
        ("rod", math.pi * 0.01**2 * (0.12 + 4.0 / 3.0 * 0.01), 0.03),
        ("link", (0.12 * 0.03 + math.pi * (0.015**2 - 2 * 0.0075**2)) * 0.01, 0.005),
        ("slotted_link", (0.12 * 0.03 - 0.06 * 0.015 + math.pi * (0.015**2 - 0.0075**2 - 2 * 0.005**2)) * 0.01, 0.005),
        ("nut", (math.sqrt(0.75) * 0.04**2 - math.pi * 0.012**2) * 0.02, 0.01),
        ("spring", math.pi * 0.003**2 * 2 * math.pi * 0.02 * 6, 0.07),
        ("rack", RACK * 8 * 0.02 * 0.004**2, 1e-12),
        ("floor", 0.4 * 0.3 * 1e-3, 1e-12),
        ("rail", None, 0.0),
    ],
)
def test_volume(kind: str, volume: float | None, shape_error: float) -> None:
    measured = shapes.volume(shapes.mesh(kind, SAMPLES[kind]))
    if volume is None:
        low, high = shapes.bounds(shapes.mesh(kind, SAMPLES[kind]))
        assert 0.6 < measured / np.prod(high - low) < 1.0
    else:
        assert measured == pytest.approx(volume, rel=max(shape_error, 1e-12))


@pytest.mark.parametrize(
    ("kind", "low", "high"),
    [
        ("rod", (-0.01, -0.01, -0.01), (0.01, 0.01, 0.13)),
        ("link", (-0.015, -0.015, -0.005), (0.135, 0.015, 0.005)),
        ("pointer", (-0.01, -0.01, -0.002), (0.1, 0.01, 0.002)),
        ("bracket", (-0.04, -0.06, -0.01), (0.04, 0.02, 0.01)),
        ("flange", (-0.04, -0.04, -0.01), (0.04, 0.04, 0.08)),
        ("t_carrier", (-0.06, -0.0128, -0.08), (0.06, 0.0128, 0.0136)),
        ("cross", (-0.04, -0.04, -0.0136), (0.04, 0.04, 0.0136)),
        ("rail", (-0.01, 0.0, 0.0), (0.01, 0.02, 0.15)),
        ("floor", (-0.2, -0.15, -0.001), (0.2, 0.15, 0.0)),
    ],
)
def test_conventions(kind: str, low: tuple[float, ...], high: tuple[float, ...]) -> None:
    assert np.allclose(shapes.bounds(shapes.mesh(kind, SAMPLES[kind])), [low, high], atol=3e-4)


def test_the_same_sizes_give_the_same_object_in_any_order() -> None:
    size = SAMPLES["link"]
    assert shapes.mesh("link", size) is shapes.mesh("link", dict(reversed(size.items())))
    assert shapes.mesh("link", size) is shapes.mesh("link", {**size, "bore": 0.25 * 0.03})
    with pytest.raises(ValueError, match="read-only"):
        shapes.mesh("link", size).vertices[0] = 0.0


def test_a_30_tooth_gear_is_light() -> None:
    assert len(shapes.mesh("spur_gear", SAMPLES["spur_gear"]).faces) <= 2500


@pytest.mark.parametrize(
    ("kind", "size", "words"),
    [
        ("spur_geer", {}, r"shape kind 'spur_geer'.*Did you mean 'spur_gear'.*bevel_gear, box"),
        ("rod", {"length": 0.1, "radios": 0.1}, r"rod: parameter 'radios'.*'radius'.*length, radius"),
        ("rod", {"length": 0.1}, r"rod: missing radius. Parameters: length, radius"),
        ("rod", {"length": 0.1, "radius": -1.0}, r"rod: radius must be greater than 0 m, got -1"),
        ("rod", {"length": 0.1, "radius": math.nan}, r"rod: radius must be finite"),
        ("disc", {"radius": 0.1, "thickness": 0.1, "holes": 2.5}, r"disc: holes must be a whole number, got 2.5"),
        ("spur_gear", {"teeth": 3, "module": 0.001, "width": 0.01}, r"teeth must be at least 5, got 3"),
        ("spur_gear", {"teeth": 20, "module": 0.001, "width": 0.01, "bore": 0.02}, r"bore 0.02 m must be smaller"),
        ("spur_gear", {"teeth": 20, "module": 0.001, "width": 0.01, "holes": 3, "spokes": 3}, r"holes or spokes"),
        ("spur_gear", {"teeth": 20, "module": 0.001, "width": 0.01, "pressure_angle": 20.0}, r"pressure_angle.*10..30"),
        ("bevel_gear", {"teeth": 20, "module": 0.001, "width": 0.01}, r"missing pitch_angle"),
        ("bevel_gear", {"teeth": 20, "module": 0.001, "width": 0.1, "pitch_angle": 0.8}, r"cone distance"),
        ("tube", {"outer": 0.01, "inner": 0.02, "length": 0.1}, r"inner radius"),
        ("disc", {"radius": 0.05, "thickness": 0.01, "holes": 6, "hole": 0.04}, r"smaller|check"),
    ],
)
def test_errors_name_the_culprit(kind: str, size: dict[str, float], words: str) -> None:
    with pytest.raises(MechlabError, match=words):
        shapes.mesh(kind, size)


def test_every_parameter_is_documented() -> None:
    for kind in shapes.KINDS.values():
        assert kind.text
        for p in kind.parameters:
            assert p.text, (kind.name, p.name)
            assert p.unit in {"m", "rad", "count", "module", "pitch"}, (kind.name, p.name)
