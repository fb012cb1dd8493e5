"""`solve` answers what is determined and lists what is open: against hand formulas, differences, and an adversary."""

import json

import numpy as np
import pytest

import mechlab as ml
from mechlab.cli import main
from mechlab.experiment.question import Answer, Answers
from mechlab.mechanism import Status, floating
from tests.benchmarks.under_given import examine


def differential() -> ml.Mechanism:
    """2 carrier = left + right: two freedoms, a constant Jacobian."""
    b = ml.Builder("differential")
    for name in ("left", "right", "carrier"):
        b.body(name, ml.revolute(name), inertia=ml.Inertia.cylinder(1.0, 0.1, 0.02))
    b.relation("gears", left=1, right=1, carrier=-2)
    return b.build()


def fourbar(kind: str = "revolute", crank=0.1, coupler=0.3, rocker=0.25, ground=0.3) -> ml.Mechanism:
    b = ml.Builder("loop", gravity=(0, -9.81, 0))
    b.bar("crank", ml.revolute("q"), crank, layer=0.02)
    b.bar("coupler", ml.revolute("c"), coupler, parent="crank", at=(crank, 0, 0), layer=0.03)
    b.bar("rocker", ml.revolute("r"), rocker, at=(ground, 0, 0), layer=0.02)
    b.loop("pin", "coupler", "rocker", at_a=(coupler, 0, 0), at_b=(rocker, 0, 0), kind=kind)
    return b.assemble({"q": 1.0, "c": -0.6, "r": 1.6}, hold=["q"])


def rocker_angle(q, crank=0.1, coupler=0.3, rocker=0.25, ground=0.3):
    """The rocker of a four-bar by two triangles."""
    end = np.array([crank * np.cos(q) - ground, crank * np.sin(q)])
    far = np.hypot(*end)
    return np.arctan2(end[1], end[0]) - np.arccos((far**2 + rocker**2 - coupler**2) / (2.0 * far * rocker))


def stewart(radius=0.5, height=0.8) -> ml.Mechanism:
    b = ml.Builder("stewart")
    b.body("plate", *floating("p"), at=(0, 0, height), inertia=ml.Inertia.cylinder(5.0, 0.3, 0.02))
    for i in range(6):
        foot_angle, top_angle = np.pi / 3 * i, np.pi / 3 * i + (0.4 if i % 2 else -0.4)
        foot = np.array([radius * np.cos(foot_angle), radius * np.sin(foot_angle), 0.0])
        top = np.array([0.6 * radius * np.cos(top_angle), 0.6 * radius * np.sin(top_angle), 0.0])
        leg = top + [0.0, 0.0, height] - foot
        b.body(f"lower_{i}", ml.spherical(f"foot_{i}"), at=tuple(foot), inertia=ml.Inertia.cylinder(0.3, 0.02, 0.3))
        axis = tuple(leg / np.linalg.norm(leg))
        b.body(
            f"upper_{i}",
            ml.prismatic(f"s{i}", axis=axis),
            parent=f"lower_{i}",
            inertia=ml.Inertia.cylinder(0.3, 0.02, 0.3),
        )
        b.loop(f"ball_{i}", f"upper_{i}", "plate", at_a=tuple(leg), at_b=tuple(top), kind="spherical")
    b.frame("tip", "plate", (0, 0, 0))
    return b.build()


def test_a_train_with_two_freedoms_and_one_rate_fixes_nothing() -> None:
    with pytest.raises(
        ml.MechlabError, match=r"left_rate.*determines nothing else.*right_rate.*give right_rate=\.\.\."
    ):
        ml.solve(differential(), left_rate=3.0)


def test_rates_of_a_train_are_the_same_in_every_pose() -> None:
    found = ml.solve(differential(), left_rate=3.0, right_rate=1.0)
    for witness in ("pinocchio", "mujoco"):
        assert found[witness]["carrier_rate"] == pytest.approx(2.0, abs=1e-12)
    assert found.assumed == {"left_accel": 0.0, "right_accel": 0.0} and not found.open


def test_a_pose_with_one_rate_missing_answers_the_pose() -> None:
    found = ml.solve(differential(), left=1.0, right=0.5, left_rate=3.0)
    assert found["mujoco"]["carrier"] == pytest.approx(0.75, abs=1e-12)
    rates, accelerations = found.open
    assert rates.quantities == ("right_rate", "carrier_rate") and rates.give == ("right_rate",)
    assert "carrier_accel" in accelerations.quantities


@pytest.mark.parametrize("kind", ["revolute", "spherical", "cylindrical"])
def test_without_a_given_acceleration_it_is_zero(kind: str) -> None:
    """r'' = d2r/dq2 q'^2 by central differences of the closed form, error h^2."""
    found, h, q = ml.solve(fourbar(kind), q=1.2, q_rate=5.0), 1e-4, 1.2
    slope = (rocker_angle(q + h) - rocker_angle(q - h)) / (2 * h)
    bend = (rocker_angle(q + h) - 2 * rocker_angle(q) + rocker_angle(q - h)) / h**2
    turn = 2.0 * np.pi
    for witness in ("pinocchio", "mujoco"):
        values = found[witness]
        assert (values["r"] - rocker_angle(q) + np.pi) % turn - np.pi == pytest.approx(0.0, abs=1e-9)
        assert values["r_rate"] == pytest.approx(5.0 * slope, abs=1e-6)
        assert values["r_accel"] == pytest.approx(25.0 * bend, abs=1e-4)
        assert values["q_accel"] == 0.0
    assert found.assumed == {"q_accel": 0.0} and found.exit_code == 0


def test_a_rate_without_a_pose_is_open_where_it_hangs_on_the_pose() -> None:
    with pytest.raises(ml.MechlabError, match=r"r_rate.* hang on q; give q=\.\.\."):
        ml.solve(fourbar(), q_rate=5.0)


def test_one_coordinate_of_a_platform_fixes_nothing() -> None:
    found = ml.solve(stewart(), tip_x=0.05)
    for witness in ("pinocchio", "mujoco"):
        assert found[witness] == {"p_x": pytest.approx(0.05, abs=1e-12)}  # the same coordinate by its other name
    assert {"p_y", "tip_z", "s5"} <= {k for x in found.open for k in x.quantities}
    assert len(found.open[0].give) == 5


def test_spins_of_rods_are_not_missing() -> None:
    """All six strokes fix the plate; each leg may turn about its own length, which hangs on nothing."""
    given = {f"s{i}": 0.02 * (-1) ** i for i in range(6)}
    found = ml.solve(stewart(), **given, tip_x_rate=0.1)
    assert {f"tip_{a}" for a in "xyz"} <= found["pinocchio"].keys()
    assert found.exit_code == 0
    assert any("s0_rate" in x.quantities for x in found.open)  # one rate of six does not fix the others


def test_at_a_dead_centre_the_pose_is_fixed_and_the_rates_are_not() -> None:
    """The crank lies over the coupler: the rocker stands still whatever the crank does."""
    m = fourbar()
    stretched = 0.3 + 0.1
    at = np.arccos((0.3**2 + stretched**2 - 0.25**2) / (2 * 0.3 * stretched))
    near = ml.solve(m, q=at)["pinocchio"]["r"]
    found = ml.solve(m, q=at, r_rate=0.0)
    assert found["pinocchio"]["r"] == pytest.approx(near, abs=1e-9)
    assert any("c_rate" in x.quantities and x.give == ("q_rate",) for x in found.open)


def test_witnesses_that_differ_are_not_to_be_trusted() -> None:
    one, two = Answer({"x": 1.0, "y": 2.0}), Answer({"x": 1.0, "y": 2.0 + 1e-4})
    apart = Answers("q", {"pinocchio": one, "mujoco": two})
    assert apart.status is Status.DISAGREE and apart.exit_code == 3 and list(apart.apart) == ["y"]
    assert Answers("q", {"pinocchio": one, "mujoco": two}, tolerance=1e-3).exit_code == 0
    assert Answers("q", {"a": Answer({"x": 1e-15}), "b": Answer({"x": -1e-15})}).exit_code == 0


def test_the_command_line_says_what_is_open(tmp_path, capsys) -> None:
    file = tmp_path / "zoo.py"
    file.write_text(
        "import mechlab as ml\n"
        "def differential():\n"
        "    b = ml.Builder('differential')\n"
        "    for name in ('left', 'right', 'carrier'):\n"
        "        b.body(name, ml.revolute(name), inertia=ml.Inertia.cylinder(1, .1, .02))\n"
        "    b.relation('gears', left=1, right=1, carrier=-2)\n"
        "    return b.build()\n"
    )
    assert main(["solve", f"{file}:differential", "left_rate=3"]) == 1
    assert "determines nothing else" in capsys.readouterr().err
    assert main(["solve", f"{file}:differential", "left=1", "right=1", "left_rate=3", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["open"][0] == {
        "quantities": ["right_rate", "carrier_rate"],
        "freedoms": ["right_rate"],
        "give": ["right_rate"],
    }
    assert document["assumed"] == {"left_accel": 0.0}


def test_a_loop_within_one_rigid_part_does_not_upset_an_engine() -> None:
    """MuJoCo drops its rows, which no motion can violate, but keeps their space."""
    b = ml.Builder("welded")
    b.body("arm", ml.revolute("q"), inertia=ml.Inertia.cylinder(1.0, 0.1, 0.02))
    b.body("tip", parent="arm", at=(0.2, 0, 0), inertia=ml.Inertia.cylinder(0.1, 0.05, 0.02))
    b.loop("void", "arm", "tip", at_a=(0.2, 0, 0), kind="spherical")
    b.frame("end", "tip", (0.1, 0, 0))
    found = ml.solve(b.build(), q=0.5)
    assert found["mujoco"]["end_x"] == pytest.approx(0.3 * np.cos(0.5), abs=1e-12)


@pytest.mark.parametrize("seed", range(1000, 1012))
def test_nothing_open_is_answered(seed: int) -> None:
    """A sample of `tests.benchmarks.under_given`: other states with the same given values agree in what was answered."""
    found = examine(seed)
    if found is None:
        pytest.skip("the drawn values are out of reach of the reference pose")
    assert not found.invented and not found.falsely_open


def test_joints_that_move_on_their_own_are_named_at_once() -> None:
    """A tree of 20 joints without loops: what is open is the other 19, of which a sentence names twelve."""
    b = ml.Builder("tree")
    for k in range(20):
        b.body(f"arm_{k}", ml.revolute(f"j{k}"), inertia=ml.Inertia.cylinder(1.0, 0.1, 0.02))
    with pytest.raises(ml.MechlabError) as error:
        ml.solve(b.build(), j0=0.1)
    text = str(error.value)
    assert "j1, j2, j3" in text and "and 7 more move on their own; give j1=... j2=..." in text
    assert "hang" not in text
