"""The page's solver in Node: slider positions and drags on fourteen mechanisms against Pinocchio, small steps and numpy; limit
positions, ranges and reach against closed forms."""

from __future__ import annotations

import json
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab.formats.mechanism_json import to_json
from mechlab.mechanism import (
    Builder,
    ConstraintSet,
    Inertia,
    Mechanism,
    TreeKinematics,
    prismatic,
    revolute,
    spherical,
    structure,
)
from mechlab.mechanism.geometry import Placement
from mechlab.mechanism.kinematics import integrate
from mechlab.viewer import html_page
from tests.viewer.solver_in_node import Conversation
from tests.viewer.solver_witness import MECHANISMS, Witness, lift, mechanism_of

EVENTS = 10
MOST_BYTES = 62_000
SOLID = Inertia.box(1.0, 0.1, 0.1, 0.1)


@pytest.mark.parametrize(("name", "fidelity"), MECHANISMS)
def test_sliders_and_drags(name: str, fidelity: str | None) -> None:
    m = mechanism_of(name, fidelity)
    rng = np.random.default_rng(11)
    with Conversation(m) as page:
        witness = Witness(m, tuple(page.ask("facts")["drives"]))
        q = m.reference()
        for _ in range(EVENTS):
            wish = witness.wish(rng, q)
            report = page.ask("solve", **wish)
            witness.check(q, wish, report)
            q = np.array(report["q"])


@pytest.mark.parametrize(("name", "fidelity"), MECHANISMS)
def test_a_drag_ends_as_near_as_it_can(name: str, fidelity: str | None) -> None:
    m = mechanism_of(name, fidelity)
    rng = np.random.default_rng(5)
    with Conversation(m) as page:
        witness = Witness(m, tuple(page.ask("facts")["drives"]))
        for _ in range(2):
            q = np.array(page.ask("set", q=m.reference().tolist()))
            wish = witness.drag(rng, q)
            for _ in range(40):  # as the page does, picture by picture
                report = page.ask("solve", **wish)
                still = np.abs(np.array(report["q"]) - q).max() < 1e-9
                q = np.array(report["q"])
                if still:
                    break
            if report["closeness"] > 1e-3 and not any(s["why"] == "singular" for s in report["stops"]):
                active = [s["name"] for s in report["stops"] if s["why"] == "range"]
                witness.check_stationary(q, wish["grab"], active)


@pytest.mark.parametrize("name", ["fourbar", "quick_return", "stephenson", "slider_crank", "bricard"])
def test_a_drag_at_once_ends_where_one_in_small_steps_ends(name: str) -> None:
    """One freedom: a drag that changed the mode unseen would end elsewhere."""
    m = mechanism_of(name, None)
    rng = np.random.default_rng(8)
    with Conversation(m) as page:
        witness, q = Witness(m, tuple(page.ask("facts")["drives"])), m.reference()
        for _ in range(3):
            wish = witness.drag(rng, q)
            ends = []
            for steps in (1, 60):
                page.ask("set", q=q.tolist())
                rotation, origin = TreeKinematics(m, q).pose(wish["grab"]["body"])
                start = origin + rotation @ np.array(wish["grab"]["point"])
                way = np.array(wish["grab"]["target"]) - start
                for share in (*np.linspace(0.0, 1.0, steps + 1)[1:], 1.0, 1.0):
                    report = page.ask("solve", grab=wish["grab"] | {"target": (start + share * way).tolist()})
                ends.append(np.array(report["q"]))
            assert witness.apart(*ends) < 1e-6  # the nearest point is flat: it is found to the root of the rounding
            q = ends[0]


@pytest.mark.parametrize("name", ["lift", "bricard", "class4_linkage"])
def test_the_jacobian_is_the_derivative_of_the_residual(name: str) -> None:
    m = mechanism_of(name, None)
    rng, step = np.random.default_rng(2), 1e-6
    with Conversation(m) as page:
        q = integrate(m, m.reference(), rng.uniform(-1.0, 1.0, m.nv))
        found = page.ask("constraints", q=q.tolist())
        jacobian = np.reshape(found["jacobian"], (-1, m.nv))
        for k in range(m.nv):
            way = step * np.eye(m.nv)[k]
            ahead, back = (page.ask("constraints", q=integrate(m, q, x).tolist())["residual"] for x in (way, -way))
            # central differences: error step^2 and rounding / step
            np.testing.assert_allclose(jacobian[:, k], (np.array(ahead) - back) / (2.0 * step), atol=1e-8)


def rocker(coupler: float = 0.15) -> Mechanism:
    """A double rocker: ground 0.3, crank 0.2, coupler, rocker 0.2."""
    b = Builder("rocker")
    b.bar("crank", revolute("crank_angle"), 0.2).bar("coupler", revolute("bend"), coupler, parent="crank", at=(0.2, 0, 0))
    b.bar("rocker", revolute("rocker_angle"), 0.2, at=(0.3, 0.0, 0.0))
    b.loop("pin", "coupler", "rocker", (coupler, 0, 0), (0.2, 0, 0), kind="revolute").drive("crank_angle")
    return b.assemble({"crank_angle": 0.8, "bend": -0.9, "rocker_angle": 1.8}, hold=("crank_angle",))


def test_rows_that_are_rounding_alone_do_not_count() -> None:
    """A planar five-bar in a tilted plane, closed by a weld: three of its six rows vanish, but for rounding."""
    tilted = Placement((0.1, 0.2, 0.3), (0.8, 0.1, -0.5, 0.3))
    b = Builder("tilted").body("base", turned=tilted)
    parent, at = "base", (0.0, 0.0, 0.0)
    for k, length in enumerate((0.2, 0.31, 0.27, 0.13)):
        b.bar(f"bar_{k}", revolute(f"joint_{k}"), length, parent=parent, at=at)
        parent, at = f"bar_{k}", (length, 0.0, 0.0)
    b.body("pin", revolute("last"), parent=parent, at=at, inertia=SOLID)
    b.loop("weld", "base", "pin", (0.3, 0.05, 0.0), kind="fixed")
    m = b.assemble({"joint_0": 1.5, "joint_1": -0.9, "joint_2": -1.0, "joint_3": -1.1, "last": 1.5})
    with Conversation(m) as page:
        assert page.ask("facts")["rank"] == structure(m).rank == 3
        witness, q = Witness(m, tuple(page.ask("facts")["drives"])), m.reference()
        wish = {"drives": {n: float(m.value(n, q)) + 0.1 for n in witness.drives}}
        witness.check(q, wish, page.ask("solve", **wish))


def test_a_limit_position_is_where_coupler_and_rocker_are_in_line() -> None:
    m = rocker()
    furthest = math.acos((0.3**2 + 0.2**2 - (0.15 + 0.2) ** 2) / (2.0 * 0.3 * 0.2))
    with Conversation(m) as page:
        home = page.ask("solve")["q"]
        stretched = page.ask("solve", drives={"crank_angle": 3.0})
        assert [(s["name"], s["why"]) for s in stretched["stops"]] == [("crank_angle", "fold")]
        assert "stretched or folded" in stretched["sentence"]
        # the solver stops where the crank's rate is 1e-4 of its usual one: 1e-8 in the angle
        assert stretched["values"]["crank_angle"] == pytest.approx(furthest, abs=1e-7)
        assert stretched["closeness"] < 1e-3
        back = page.ask("solve", drives={"crank_angle": m.zero("crank_angle")})
        assert not back["stops"] and not back["modeChanged"]
        np.testing.assert_allclose(back["q"], home, atol=1e-10)


def test_a_drag_through_a_limit_position_says_so() -> None:
    """The rocker of a double rocker is pulled on past the limit position of the crank: the crank turns back."""
    m = rocker()
    with Conversation(m) as page:
        said = []
        for angle in np.arange(1.9, 2.9, 0.05):
            tip = [0.3 + 0.2 * math.cos(angle), 0.2 * math.sin(angle), 0.0]
            report = page.ask("solve", grab={"body": "rocker", "point": [0.2, 0.0, 0.0], "target": tip})
            said.append(report["modeChanged"])
            if report["miss"] > 1e-9:
                break
        assert sum(said) == 1
        other = Witness(m, ("crank_angle",))
        assert other.mode(np.array(report["q"])) == -other.mode(m.reference())


def test_the_range_of_a_joint_stops_the_drive() -> None:
    """A slider-crank of crank 0.1 and rod 0.3 whose slide ends 0.05 inside its dead position."""
    b = Builder("piston")
    b.bar("crank", revolute("crank_angle"), 0.1).bar("rod", revolute("rod_angle"), 0.3, parent="crank", at=(0.1, 0, 0))
    b.body("slide", prismatic("travel", "x", range=(0.25, 1.0)), inertia=SOLID)
    b.loop("pin", "rod", "slide", (0.3, 0, 0), kind="revolute").drive("crank_angle")
    m = b.assemble({"crank_angle": 1.0, "rod_angle": -1.3, "travel": 0.34}, hold=("crank_angle",))
    expected = math.acos((0.25**2 + 0.1**2 - 0.3**2) / (2.0 * 0.25 * 0.1))
    with Conversation(m) as page:
        report = page.ask("solve", drives={"crank_angle": 3.0})
        assert report["stops"] == [{"name": "travel", "why": "range"}]
        assert report["values"]["travel"] == pytest.approx(0.25, abs=1e-12)
        assert report["values"]["crank_angle"] == pytest.approx(expected, abs=1e-11)
        assert not page.ask("solve", drives={"crank_angle": 1.5})["stops"]


def arm(**options: object) -> Mechanism:
    """A planar arm of two bars of 0.2, which nothing closes; options of its elbow."""
    b = Builder("arm").bar("upper", revolute("shoulder"), 0.2)
    b.bar("fore", revolute("elbow", zero=0.5, **options), 0.2, parent="upper", at=(0.2, 0.0, 0.0))
    return b.build()


def test_a_grabbed_point_goes_to_its_target_or_as_near_as_it_can() -> None:
    tip = [0.2, 0.0, 0.0]
    with Conversation(arm()) as page:
        report = page.ask("solve", grab={"body": "fore", "point": tip, "target": [0.1, 0.25, 0.0]})
        assert report["miss"] < 1e-12
        target = [0.4, 0.5, 0.1]
        for _ in range(5):
            report = page.ask("solve", grab={"body": "fore", "point": tip, "target": target})
        nearest = math.hypot(math.hypot(0.4, 0.5) - 0.4, 0.1)
        # the miss is stationary: it is right to the square of the last step
        assert report["miss"] == pytest.approx(nearest, abs=1e-10)


def test_a_locked_joint_holds_while_a_point_is_pulled() -> None:
    with Conversation(arm()) as page:
        before = page.ask("solve")["values"]
        grab = {"body": "fore", "point": [0.2, 0.0, 0.0], "target": [0.0, 0.3, 0.0]}
        report = page.ask("solve", locked=["elbow"], grab=grab)
        assert report["values"]["elbow"] == pytest.approx(before["elbow"], abs=1e-13)
        reach = math.sqrt(0.08 + 0.08 * math.cos(report["values"]["elbow"] - 0.5))
        assert report["miss"] == pytest.approx(abs(reach - 0.3), abs=1e-10)
        report = page.ask("solve", locked=["elbow"], drives={"elbow": 1.0})
        assert report["stops"] == [{"name": "elbow", "why": "locked"}]


def pulled_far(m: Mechanism, page: Conversation, rng: np.random.Generator) -> dict[str, object]:
    """The report after a body of m was pulled from home to a point out of reach, picture by picture."""
    size, q = page.ask("facts")["size"], np.array(page.ask("set", q=m.reference().tolist()))
    body, point = str(rng.choice([b.name for b in m.bodies])), rng.uniform(-0.05, 0.05, 3) * size
    rotation, origin = TreeKinematics(m, q).pose(body)
    start, way = origin + rotation @ point, rng.normal(size=3) * size * rng.choice([0.3, 1.0, 3.0])
    for picture in range(30):
        grab = {"body": body, "point": point.tolist(), "target": (start + way * min(1.0, (picture + 1) / 12)).tolist()}
        report = page.ask("solve", grab=grab)
    return report


def test_a_pull_out_of_reach_leaves_a_margin_where_the_closure_is_singular() -> None:
    """Where the closure loses rank, no drive can be moved on: a pull keeps away from it, by numpy's singular values."""
    m = ml.load("delta6").mechanism("full")
    constraints, scale = ConstraintSet(m), Witness(m, ()).scale
    rng = np.random.default_rng(1)

    def least(q: object) -> float:
        """Smallest singular value that counts."""
        jacobian = constraints.jacobian(TreeKinematics(m, np.array(q))) * scale
        return float(np.linalg.svd(jacobian)[1][structure(m).rank - 1])

    near = []
    with Conversation(m) as page:
        for _ in range(24):
            report = pulled_far(m, page, rng)
            assert report["closed"]
            near.append(least(report["q"]) / least(m.reference()))
    # the page's margin is 1e-3 of a pivot of scaled rows, which is the singular value to a factor of ten or so
    assert min(near) > 1e-4


def test_a_joint_at_the_end_of_its_range_is_held_and_let_go() -> None:
    grab = {"body": "fore", "point": [0.2, 0.0, 0.0]}
    with Conversation(arm(range=(0.2, 1.5))) as page:
        folded = page.ask("solve", grab=grab | {"target": [0.05, 0.1, 0.0]})
        assert folded["values"]["elbow"] == pytest.approx(1.5, abs=1e-12)
        assert folded["stops"] == [{"name": "elbow", "why": "range"}]
        reach = 0.4 * math.cos(0.5 * (1.5 - 0.5))
        assert folded["miss"] == pytest.approx(reach - math.hypot(0.05, 0.1), abs=1e-9)
        opened = page.ask("solve", grab=grab | {"target": [0.38, 0.05, 0.0]})
        assert not opened["stops"] and opened["miss"] < 1e-12
        assert opened["values"]["elbow"] == pytest.approx(0.5 + 2.0 * math.acos(math.hypot(0.38, 0.05) / 0.4), abs=1e-10)


def test_a_ball_joint_keeps_its_tilt_within_its_range() -> None:
    m = Builder("ball").body("stick", spherical("ball", range=(0.0, 0.4)), inertia=SOLID).build()
    with Conversation(m) as page:
        grab = {"body": "stick", "point": [0.0, 0.0, 0.3], "target": [0.3, 0.0, 0.0]}
        q = np.array(page.ask("solve", grab=grab)["q"])
        assert 2.0 * math.acos(abs(q[0])) == pytest.approx(0.4, abs=1e-10)
        np.testing.assert_allclose(q, [math.cos(0.2), 0.0, math.sin(0.2), 0.0], atol=1e-8)


def test_a_drive_that_others_hold_is_locked() -> None:
    b = Builder("gears").body("a", revolute("a"), inertia=SOLID).body("b", revolute("b"), at=(0.3, 0.0, 0.0), inertia=SOLID)
    m = b.gears("mesh", "a", "b", (17, 34)).build()
    with Conversation(m) as page:
        assert page.ask("solve", drives={"a": 1.0})["values"]["b"] == pytest.approx(-0.5, abs=1e-14)
        assert page.ask("solve", drives={"a": 2.0}, locked=["b"])["stops"] == [{"name": "a", "why": "locked"}]


def test_a_drawn_shaft_is_grabbed_by_its_teeth() -> None:
    m = ml.load("planetary").mechanism("minimal")
    shaft = next(s for s in m.shafts if s.shapes)
    with Conversation(m) as page:
        name = next(n for n in page.ask("facts")["bodies"] if n.startswith(shaft.name))
        home = page.ask("solve")["values"][shaft.name]
        poses = page.ask("poses", q=m.reference().tolist())
        k = page.ask("facts")["bodies"].index(name)
        place = np.array(poses["position"][3 * k : 3 * k + 3])
        turned = page.ask("poses", q=(m.reference() + 0.2).tolist())
        assert turned["quaternion"][4 * k : 4 * k + 4] != poses["quaternion"][4 * k : 4 * k + 4]
        rotation = shaft.placement.rotation
        target = place + rotation @ (0.02 * np.array([math.cos(0.05), math.sin(0.05), 0.0]))
        if not np.allclose(turned["position"][3 * k : 3 * k + 3], place):
            pytest.skip("the axis of this shaft travels")
        report = page.ask("solve", grab={"body": name, "point": [0.02, 0.0, 0.0], "target": target.tolist()})
        assert report["miss"] < 1e-10
        assert abs(report["values"][shaft.name] - home) == pytest.approx(0.05, abs=1e-9)


def test_rows_values_and_ranges_are_those_of_the_model() -> None:
    m = lift()
    q = integrate(m, m.reference(), np.full(m.nv, 0.1))
    with Conversation(m) as page:
        for name in m.scalar_names:
            np.testing.assert_array_equal(page.ask("row", name=name), m.row(name))
            assert page.ask("value", name=name, q=q.tolist()) == pytest.approx(float(m.value(name, q)), abs=1e-15)
        assert m.row("wheel").max() == float(Fraction(17, 5))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.pop("format"), "holds no mechanism"),
        (lambda d: d.update(schema=7), "schema 7"),
        (lambda d: d["bodies"][0].update(parent="nobody"), "nobody"),
        (lambda d: d["loops"][0].update(kind="magic"), "magic"),
        (lambda d: d["loops"][0].update(body_a="nobody"), "nobody"),
        (lambda d: d["shafts"][0]["coefficients"].update(nothing="1"), "nothing"),
        (lambda d: d["bodies"][0]["joints"][0].update(axis=[0, 0, 0]), "no direction"),
    ],
)
def test_a_document_that_cannot_be_read_is_refused_in_a_sentence(change: object, said: str) -> None:
    document = json.loads(to_json(lift()))
    change(document)  # type: ignore[operator]
    with Conversation(lift()) as page, pytest.raises(AssertionError, match=said):
        page.read(document)


def test_impossible_wishes_are_refused_by_name() -> None:
    with Conversation(arm()) as page:
        with pytest.raises(AssertionError, match="wrist.*shoulder, elbow"):
            page.ask("solve", drives={"wrist": 1.0})
        with pytest.raises(AssertionError, match="hand"):
            page.ask("solve", grab={"body": "hand", "point": [0, 0, 0], "target": [0, 0, 0]})
        with pytest.raises(AssertionError, match="3 coordinates"):
            page.ask("set", q=[0.0, 0.0, 0.0])


def test_the_solver_is_small() -> None:
    folder = Path(html_page.__file__).parent / "page"
    assert sum((folder / name).stat().st_size for name in html_page.SOLVER) <= MOST_BYTES
