"""Editing: a Builder of what was loaded, changed, attached to, and closed again."""

import math
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab import catalog
from mechlab.errors import MechlabError
from mechlab.mechanism import ConstraintSet, TreeKinematics, integrate


@pytest.mark.parametrize("name", catalog.NAMES)
def test_unchanged_it_is_the_same_at_every_fidelity(name: str) -> None:
    design = ml.load(name)
    levels = [f for f in design.entry.fidelities if f != "kinematic"]
    assert levels
    for level in levels:
        assert ml.edit(design, fidelity=level).build() == design.mechanism(level)


def test_a_file_and_parameters(tmp_path: Path) -> None:
    m = ml.load("fourbar", crank=0.05).mechanism()
    (tmp_path / "a.json").write_text(ml.to_json(m))
    assert ml.edit(tmp_path / "a.json").build() == m == ml.edit("fourbar", crank=0.05).build() == ml.edit(m).build()


def arm(links: int = 2) -> ml.Builder:
    """An open chain in the xy plane, 1 m a link, stretched along x; gravity along -y."""
    b = ml.Builder("arm", gravity=(0, -9.81, 0))
    for k in range(links):
        b.bar(
            f"link_{k}",
            ml.revolute(f"j_{k}"),
            1.0,
            parent=f"link_{k - 1}" if k else "ground",
            at=(1.0 if k else 0.0, 0, 0),
        )
    return b


def test_a_loop_added_to_an_open_chain_closes_where_triangles_say() -> None:
    b = ml.edit(arm().build())
    b.loop("tip", "link_1", "ground", at_a=(1, 0, 0), at_b=(1.2, 0, 0), kind="revolute")
    m = b.assemble({"j_0": "50deg", "j_1": "-100deg"})
    assert np.all(m.reference() == 0.0)
    # isosceles: base 1.2, legs 1
    first = math.acos(0.6)
    assert m.zero("j_0") == pytest.approx(first, abs=1e-12) and m.zero("j_1") == pytest.approx(-2 * first, abs=1e-12)
    assert float(np.abs(ConstraintSet(m).residual(TreeKinematics(m))).max()) < 1e-12


def test_an_open_loop_is_named() -> None:
    b = arm().loop("far", "link_1", "ground", at_a=(1, 0, 0), at_b=(5, 0, 0))
    with pytest.raises(MechlabError, match="far"):
        b.assemble()


def test_belt_drive_spring_and_mass() -> None:
    b = ml.edit(arm().build()).change_body("link_1", mass="3kg").change("j_0", damping=0.2)
    b.mesh(ml.belt("belt", "j_0", "j_1", 1, 2))
    b.drive("j_0", stiffness=5.0, damping=1.0).spring(ml.Spring("coil", "ground", "link_1", (0, 1, 0), (1, 0, 0), 10.0))
    m = b.build()
    assert m.total_mass == pytest.approx(4.0) and m.joint("j_0").damping == 0.2
    # a uniform rod keeps its radius of gyration
    assert m.body("link_1").inertia.tensor[2] == pytest.approx(3 * arm().build().body("link_1").inertia.tensor[2])
    model, data = ml.load(m).to_mujoco()
    data.qvel[:] = 0.0
    assert model.nu == 1 and model.neq == 1 and sum(model.body_mass) == pytest.approx(4.0)


def test_gears_are_added_with_their_ratio() -> None:
    two = ml.Builder("two").bar("a", ml.revolute("qa"), 0.1).bar("b", ml.revolute("qb"), 0.1, at=(0.3, 0, 0)).build()
    m = ml.edit(two).gears("teeth", "qa", "qb", (20, 40)).build()
    assert {n: float(c) for n, c in m.relations[0].coefficients} == {"qa": 1.0, "qb": 2.0}


def host_and_guest() -> tuple[ml.Mechanism, ml.Mechanism]:
    """An arm with a frame at its tip; a slider-crank of the catalog with a spring and a frame on its ground."""
    host = (
        arm().frame("tip", "link_1", (1, 0, 0), ml.Placement(quaternion=(math.cos(0.4), 0, 0, math.sin(0.4)))).build()
    )
    guest = ml.edit("slider_crank").spring(
        ml.Spring("pull", "ground", "crank", (0.3, 0.1, 0), (0, 0, 0), 40.0, 1.0, 0.1)
    )
    guest.frame("seat", "ground", (0.1, 0.2, 0.3)).ground(ml.shape("box", name="foot", x=0.1, y=0.1, z=0.02))
    return host, guest.build()


def test_attached_everything_moves_as_it_did_alone() -> None:
    host, guest = host_and_guest()
    m = ml.edit(host).attach(guest, at="tip", prefix="arm_").build()
    assert m.gravity == host.gravity and {b.name for b in m.bodies} >= {f"arm_{b.name}" for b in guest.bodies}
    for kind in ("loops", "relations", "shafts", "springs", "drives", "frames"):
        assert len(getattr(m, kind)) == len(getattr(host, kind)) + len(getattr(guest, kind))
    rng = np.random.default_rng(3)
    q = m.reference()
    moved = integrate(guest, guest.reference(), rng.uniform(-0.5, 0.5, guest.nv))
    for joint in guest.joints:
        q[m.q_slice[f"arm_{joint.name}"]] = moved[guest.q_slice[joint.name]]
    for joint in host.joints:
        q[m.q_slice[joint.name]] = rng.uniform(-1, 1)
    alone, whole = TreeKinematics(guest, moved), TreeKinematics(m, q)
    tip = whole.matrix("link_1") @ m.frame("tip").placement.matrix()
    for body in guest.bodies:
        np.testing.assert_allclose(whole.matrix(f"arm_{body.name}"), tip @ alone.matrix(body.name), atol=1e-14)
    seat = m.frame("arm_seat")
    np.testing.assert_allclose(
        whole.matrix(seat.body) @ seat.placement.matrix(), tip @ guest.frame("seat").placement.matrix(), atol=1e-14
    )
    np.testing.assert_allclose(  # residuals are in the frame of the loop's body a or b, not in the world
        np.linalg.norm(ConstraintSet(m).residual(whole)),
        np.linalg.norm(ConstraintSet(guest).residual(alone)),
        atol=1e-12,
    )
    pull = next(s for s in m.springs if s.name == "arm_pull")
    assert pull.body_a == "link_1"
    ends = [whole.matrix(b) @ [*p, 1] for b, p in ((pull.body_a, pull.point_a), (pull.body_b, pull.point_b))]
    own = [alone.matrix(b) @ [*p, 1] for b, p in (("ground", (0.3, 0.1, 0.0)), ("crank", (0.0, 0.0, 0.0)))]
    assert np.linalg.norm(ends[0] - ends[1]) == pytest.approx(np.linalg.norm(own[0] - own[1]), abs=1e-14)
    assert any(s.name == "arm_foot" for s in m.body("link_1").shapes)


def test_on_the_ground_it_moves_as_alone_in_mujoco() -> None:
    guest = ml.load("slider_crank").mechanism()
    m = ml.Builder("two", gravity=guest.gravity).attach(guest).attach(guest, prefix="b_").build()
    (model, data), (one, first) = ml.load(m).to_mujoco(), ml.load(guest).to_mujoco()
    for _ in range(100):
        mujoco.mj_step(one, first)
        mujoco.mj_step(model, data)
    n = guest.nv
    assert float(np.abs(first.qpos).max()) > 1e-3
    # two systems without a connection, one matrix: equal to the tolerance of the constraint solver (1e-8)
    np.testing.assert_allclose(data.qpos[:n], first.qpos[:n], atol=1e-7)
    np.testing.assert_allclose(data.qpos[n : 2 * n], first.qpos[:n], atol=1e-7)


def test_attach_says_what_is_wrong() -> None:
    host, guest = host_and_guest()
    with pytest.raises(MechlabError, match=r"link_0.*exist already: give prefix='arm_'"):
        ml.edit(host).attach(host)
    with pytest.raises(MechlabError, match=r"'tp' does not exist. Did you mean 'tip'\?.*Frames: tip"):
        ml.edit(host).attach(guest, at="tp")
    with pytest.raises(MechlabError, match=r"ml.load"):
        ml.edit(host).attach("fourbar")  # type: ignore[arg-type]
    assert ml.edit(host).attach(ml.load("pendulum"), at="link_0", prefix="p_").build().total_mass > host.total_mass


def test_change_rename_remove() -> None:
    m = ml.load("slider_crank").mechanism()
    joint, loop = m.joints[0].name, m.loops[0]
    swapped = ml.edit(m).rename(joint, "turn").rename(loop.body_a, "part", kind="body").build()
    assert swapped.joints[0].name == "turn" and swapped.loops[0].body_a == "part"
    back = ml.edit(swapped).rename("turn", joint).rename("part", loop.body_a, kind="body").build()
    assert back == m
    with pytest.raises(MechlabError, match=f"loop '{loop.name}'.*with_dependents"):
        ml.edit(m).remove(loop.body_a, kind="body")
    left = ml.edit(m).remove(loop.body_a, kind="body", with_dependents=True).build()
    assert not left.loops and loop.body_a not in {b.name for b in left.bodies}
    assert ml.edit(m).remove(loop.name).build() == replace(m, loops=m.loops[1:])


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (lambda b: b.change("j_9", damping=1), r"part 'j_9' does not exist. Did you mean 'j_"),
        (lambda b: b.change("j_0", dampng=1), r"joint 'j_0': option 'dampng' does not exist. Did you mean 'damping'"),
        (lambda b: b.change("j_0", name="x"), r"option 'name' does not exist"),
        (lambda b: b.change("j_0", kind="jiont", damping=1), r"kind of part 'jiont' does not exist. Did you mean 'joint'"),
        (lambda b: b.change_body("link_0", mas=1), r"option 'mas' does not exist"),
        (lambda b: b.change_body("link_0", mass="2m"), r"mass: expected a number \[kg\]"),
        (lambda b: b.rename("link_0", "link_1"), r"there is a body 'link_1' already"),
        (lambda b: b.drive("j_0").change("j_0", damping=1), r"is the name of a joint and of a drive: say kind="),
        (lambda b: b.remove("nothing"), r"part 'nothing' does not exist"),
    ],
)  # fmt: skip
def test_a_wrong_edit_is_named(work: object, words: str) -> None:
    with pytest.raises(MechlabError, match=words):
        work(arm())  # type: ignore[operator]
