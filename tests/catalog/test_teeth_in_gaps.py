"""A tooth stands in a gap at every mesh of the epicyclic trains, in the reference pose and after the carrier has moved."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from mechlab.catalog import planetary_stage, wolfrom
from mechlab.mechanism import GROUND, Mechanism, TreeKinematics
from mechlab.mechanism.angle_basis import dependent_angles
from mechlab.mechanism.geometry import Placement
from mechlab.mechanism.parts import Shape
from mechlab.shapes.involute import Teeth, internal_outline, spur_outline
from tests.shapes.test_gears import dense, depth

ALPHA = math.radians(20.0)
MAKERS = {
    "planetary_stage": lambda fidelity: planetary_stage.build(planetary_stage.Parameters(), fidelity),
    "planetary_stage, free ring": lambda fidelity: planetary_stage.build(
        planetary_stage.Parameters(ring="free"), fidelity
    ),
    "wolfrom": lambda fidelity: wolfrom.build(wolfrom.Parameters(), fidelity),
    "wolfrom, four unlike planet gears": lambda fidelity: wolfrom.build(
        wolfrom.Parameters(teeth=(22, 44, 110, 40, 108), planets=4), fidelity
    ),
}


def gear_outlines(m: Mechanism, q: np.ndarray) -> Iterator[tuple[Shape, np.ndarray, np.ndarray, float]]:
    """(shape, outline in the world plane, centre, height) of every gear, of bodies, shafts and the ground."""
    tree = TreeKinematics(m, q)
    seen: list[tuple[Shape, np.ndarray]] = [(s, np.eye(4)) for s in m.ground_shapes]
    seen += [(s, tree.matrix(b.name)) for b in m.bodies for s in b.shapes]
    for shaft in m.shafts:
        angle = float(m.value(shaft.name, q))
        turn = Placement((0, 0, 0), (math.cos(angle / 2), 0, 0, math.sin(angle / 2))).matrix()
        home = np.eye(4) if shaft.body == GROUND else tree.matrix(shaft.body)
        seen += [(s, home @ shaft.placement.matrix() @ turn) for s in shaft.shapes]
    for s, pose in seen:
        if s.kind in ("spur_gear", "internal_gear"):
            p = s.parameters
            make = spur_outline if s.kind == "spur_gear" else internal_outline
            flat = dense(make(Teeth(int(p["teeth"]), p["module"], ALPHA, 0.04 * p["module"]), p["phase"]), 2)
            place = pose @ s.placement.matrix()
            points = np.column_stack([flat, np.zeros(len(flat)), np.ones(len(flat))]) @ place.T
            yield s, points[:, :2], place[:2, 3], float(place[2, 3])


def deepest(m: Mechanism, q: np.ndarray) -> tuple[float, int]:
    """How deep teeth stand in each other, in modules, and the number of meshes looked at."""
    gears = list(gear_outlines(m, q))
    worst, meshes = 0.0, 0
    for i, (a, outline_a, centre_a, z_a) in enumerate(gears):
        for b, outline_b, centre_b, z_b in gears[i + 1 :]:
            if abs(z_a - z_b) > 1e-9 or np.allclose(centre_a, centre_b):
                continue
            rings = [s.kind == "internal_gear" for s in (a, b)]
            module, apart = a.parameters["module"], float(np.linalg.norm(centre_a - centre_b))
            radii = [0.5 * module * s.parameters["teeth"] for s in (a, b)]
            if abs(apart - (abs(radii[0] - radii[1]) if any(rings) else sum(radii))) > 1e-9:
                continue
            meshes += 1
            # The pitch point: from the centre of a towards b, or through a planet to its ring.
            along = (centre_b - centre_a) / apart * (-1.0 if any(rings) and radii[0] < radii[1] else 1.0)
            point = centre_a + radii[0] * along
            near_a, near_b = (x[np.linalg.norm(x - point, axis=1) < 4 * module] for x in (outline_a, outline_b))
            worst = max(worst, depth(near_a, outline_b, rings[1]), depth(near_b, outline_a, rings[0]))
    return worst / gears[0][0].parameters["module"], meshes


@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.parametrize("fidelity", ["minimal", "full"])
def test_no_tooth_stands_in_another(name: str, fidelity: str) -> None:
    m = MAKERS[name](fidelity)
    k = dependent_angles(m).matrix
    planets = sum(s.name.startswith("planet_") and "spin" not in s.name for s in m.shafts) or sum(
        b.name.startswith("planet_") for b in m.bodies
    )
    rng = np.random.default_rng(6)
    for pose in range(4):
        y = np.zeros(k.shape[1]) if pose == 0 else rng.uniform(-3.0, 3.0, k.shape[1])
        overlap, meshes = deepest(m, k @ y)
        assert meshes == planets * (3 if "wolfrom" in name else 2)
        assert overlap == 0.0  # with a backlash of 0.04 modules there is air on both flanks


def test_the_check_would_see_a_wrong_planet() -> None:
    """A planet turned by a tenth of a pitch against its carrier and sun."""
    m = MAKERS["planetary_stage"]("full")
    q = m.reference()
    q[m.q_slice["planet_1"].start] += 0.1 * 2 * math.pi / 30
    assert deepest(m, q)[0] > 0.05
