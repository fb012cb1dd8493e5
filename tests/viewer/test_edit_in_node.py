"""Editing a model document in the page's scripts, in Node: against Builder.assemble, Builder.bar, GearMesh and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic.fourbar import solve
from mechlab.formats.mechanism_json import from_json, to_json
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute, spherical
from mechlab.mechanism.assembly import close
from mechlab.mechanism.gears import GearMesh
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.parts import shape
from mechlab.mechanism.tree import reference_poses
from mechlab.viewer.html_page import GEOMETRY, SOLVER
from tests.viewer.solver_in_node import in_node

SCRIPTS = (*SOLVER, *GEOMETRY)
CLOSED = 1e-12
"""What a reference pose must close to."""


def fourbar(crank: float = 0.1, coupler: float = 0.3, rocker: float = 0.25, ground: float = 0.3, **bars: Any) -> Mechanism:
    """A four-bar of bars with their usual mass, its crank at 1 rad."""
    b = Builder("bars", gravity=(0.0, -9.81, 0.0))
    b.bar("crank", revolute("crank_angle"), crank, **bars)
    b.bar("coupler", revolute("coupler_joint"), coupler, parent="crank", at=(crank, 0.0, 0.0), **bars)
    b.bar("rocker", revolute("rocker_angle"), rocker, at=(ground, 0.0, 0.0), **bars)
    b.loop("pin", "coupler", "rocker", (coupler, 0.0, 0.0), (rocker, 0.0, 0.0))
    b.drive("crank_angle", 200.0, 2.0)
    return b.assemble({"crank_angle": 1.0, "coupler_joint": -0.4, "rocker_angle": 1.5}, hold=["crank_angle"])


def poses(mechanism: Mechanism) -> dict[str, tuple[Array, Array]]:
    return dict(reference_poses(mechanism.bodies))


@pytest.mark.parametrize("name", ["fourbar", "planetary", "delta6", "bricard", "andrews"])
def test_a_document_is_written_as_python_writes_it(name: str) -> None:
    """Byte by byte the JSON of `generate`: every double comes back."""
    model = api.load(name).drawn()
    assert in_node(model, [{"ask": "text"}], SCRIPTS) == [to_json(model)]


@pytest.mark.parametrize("name", ["fourbar", "slider_crank", "gear_linkage", "delta6"])
def test_a_pose_becomes_the_reference_pose_as_in_assemble(name: str) -> None:
    """Placements and zeros are those of Builder.assemble at the same closed coordinates."""
    model = api.load(name).drawn()
    drive = in_node(model, [{"ask": "facts"}], SCRIPTS)[0]["drives"][0]
    q = close(model, targets={drive: float(model.value(drive, model.reference())) + 0.2}, steps=8).q
    (text,) = in_node(model, [{"ask": "rebased", "q": q.tolist()}], SCRIPTS)
    found = from_json(text)
    expected = dict(zip([b.name for b in model.bodies], _poses_at(model, q), strict=True))
    for body in found.bodies:
        rotation, origin = poses(found)[body.name]
        np.testing.assert_allclose(origin, expected[body.name][:3, 3], atol=CLOSED)
        np.testing.assert_allclose(rotation, expected[body.name][:3, :3], atol=CLOSED)
    for joint in found.joints:
        if joint.nv == 1:
            assert joint.zero == pytest.approx(float(model.value(joint.name, q)), abs=CLOSED)
    for shaft in found.shafts:
        assert shaft.zero == pytest.approx(float(model.value(shaft.name, q)), abs=CLOSED)


def _poses_at(model: Mechanism, q: Array) -> Array:
    return np.asarray(ManyPoses(model).set(q[None]).poses()[0])


def test_a_moved_pivot_leaves_the_others_where_they_are() -> None:
    """The lengths become the distances of the pivots; bars keep the mass that Builder.bar gives them."""
    model = fourbar()
    before = {p["name"]: np.array(p["point"]) for p in in_node(model, [{"ask": "pivots"}], SCRIPTS)[0]}
    by = [0.03, -0.02, 0.0]
    for name in before:
        (moved,) = in_node(model, [{"ask": "move", "name": name, "by": by}], SCRIPTS)
        after = {p["name"]: np.array(p["point"]) for p in moved["pivots"]}
        for other, point in before.items():
            np.testing.assert_allclose(after[other], point + (np.array(by) if other == name else 0.0), atol=1e-15)
        a, b, c, d = (after[n] for n in ("crank_angle", "coupler_joint", "pin", "rocker_angle"))
        found = from_json(moved["text"])
        lengths = [float(np.linalg.norm(y - x)) for x, y in ((a, b), (b, c), (d, c))]
        twin = fourbar(*lengths, ground=float(np.linalg.norm(d - a)))
        for body, same, length in zip(found.bodies, twin.bodies, lengths, strict=True):
            assert body.shapes[0].parameters == pytest.approx(same.shapes[0].parameters, rel=1e-12)
            assert body.inertia.mass == pytest.approx(length, rel=1e-12)
            np.testing.assert_allclose(body.inertia.tensor, same.inertia.tensor, rtol=1e-9, atol=1e-18)
        angle = np.arctan2(*(b - a)[1::-1])
        assert found.joint("crank_angle").zero == pytest.approx(angle, abs=1e-14)
        assert moved["kept"] == []


def test_a_typed_length_is_assembled_in_the_same_mode() -> None:
    """The crank of the other length stands at the same angle; the rocker where the closed form has it."""
    model = fourbar()
    (done,) = in_node(model, [{"ask": "edit", "part": "crank", "row": "length", "to": 0.14}], SCRIPTS)
    found = from_json(done["text"])
    assert not done["moved"] and found.joint("crank_angle").zero == pytest.approx(1.0, abs=CLOSED)
    expected = solve(0.14, 0.3, 0.25, 0.3, 1.0, mode=1)
    assert found.joint("rocker_angle").zero == pytest.approx(float(expected.rocker_angle), abs=1e-11)


def test_what_cannot_be_closed_is_refused_with_the_last_length_that_closes() -> None:
    """Grashof's limit: the longest crank is coupler + rocker + ground, with the drive let go."""
    model = fourbar()
    (done,) = in_node(model, [{"ask": "edit", "part": "crank", "row": "length", "to": 1.5}], SCRIPTS)
    assert "assembled" in done["refused"]
    assert done["reached"] == pytest.approx(0.85, rel=2e-3)


def geared() -> Mechanism:
    """A sun on the ground, a planet on an arm, both on the ground; spur gears of 2 mm."""
    b = Builder("train")
    solid = Inertia.cylinder(0.1, 0.02, 0.01)
    b.body("sun", revolute("sun"), inertia=solid, shapes=[shape("spur_gear", teeth=20, module=0.002, width=0.01)])
    b.body("arm", revolute("arm"), inertia=solid)
    wheel = shape("spur_gear", teeth=30, module=0.002, width=0.01)
    b.body("planet", revolute("planet"), parent="arm", at=(0.05, 0.0, 0.0), inertia=solid, shapes=[wheel])
    b.mesh(GearMesh("mesh", "sun", "planet", "arm", "external", (20, 30)))
    return b.build()


def test_a_tooth_count_changes_the_ratio_as_a_mesh_has_it() -> None:
    """The relation is a multiple of the one of GearMesh with the other teeth; axes that do not fit are said in numbers."""
    (done,) = in_node(geared(), [{"ask": "edit", "part": "planet", "row": "teeth of planet", "to": 40, "stepwise": False}], SCRIPTS)
    found = from_json(done["text"])
    b = Builder.of(found)
    b.meshes = [GearMesh("mesh", "sun", "planet", "arm", "external", (20, 40))]
    row, expected = (m.coefficient_row(m.relations[0].coefficients) for m in (found, b.build()))
    np.testing.assert_allclose(row / row[0], expected / expected[0], rtol=1e-15)
    assert dict(found.body("planet").shapes[0].size)["teeth"] == 40.0
    assert len(done["faults"]) == 1 and "50 mm apart" in done["faults"][0] and "need 60 mm" in done["faults"][0]


def test_an_axis_of_a_spatial_mechanism_and_a_mass_that_stays() -> None:
    """A pendulum with a tilted axis; the mass of a part that is no bar is kept and named."""
    b = Builder("two")
    b.body("arm", revolute("swing", "x"), inertia=Inertia.box(1.0, 0.1, 0.2, 0.3))
    b.body("ball", spherical("ball"), parent="arm", at=(0.0, 0.0, -0.4), inertia=Inertia.box(1.0, 0.1, 0.1, 0.1))
    model = b.build()
    axis, moved = in_node(
        model,
        [
            {"ask": "edit", "part": "arm", "row": "axis of swing, y", "to": 1.0},
            {"ask": "edit", "part": "ball", "row": "stands in arm, z", "to": -0.5},
        ],
        SCRIPTS,
    )
    np.testing.assert_allclose(from_json(axis["text"]).joint("swing").axis, np.array([1.0, 1.0, 0.0]) / np.sqrt(2), atol=1e-15)
    found = from_json(moved["text"])
    assert moved["kept"] == ["arm"] and found.body("ball").placement.position == (0.0, 0.0, -0.5)
    assert found.body("arm").inertia == model.body("arm").inertia
