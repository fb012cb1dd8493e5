"""Why a mechanism does not close: the gap of a four-bar with its crank held, by the triangle inequality."""

import math

import numpy as np
import pytest

import mechlab as ml
from mechlab.kit.open_loops import least_opening, opening
from mechlab.kit.witness import engine_answer
from mechlab.mechanism import Status
from tests.mechanism.samples import fourbar, two_chains

CASES = [(0.3, 0.3, 0.25, 0.3, math.pi), (0.1, 0.05, 0.4, 0.3, 0.5), (0.2, 0.7, 0.25, 0.3, 0.3)]


def short(crank: float, coupler: float, rocker: float, ground: float, angle: float) -> float:
    """How far coupler and rocker are from spanning the distance of their pivots [m]."""
    distance = math.hypot(ground - crank * math.cos(angle), crank * math.sin(angle))
    return max(distance - coupler - rocker, abs(coupler - rocker) - distance)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("scale", [1.0, 1000.0])
def test_both_engines_say_the_gap_that_the_triangle_inequality_leaves(case: tuple[float, ...], scale: float) -> None:
    *lengths, angle = case
    want = short(*lengths, angle)
    assert want > 0.02
    names = dict(zip(("crank", "coupler", "rocker", "ground"), (scale * x for x in lengths), strict=True))
    answers = ml.solve("fourbar", crank_angle=angle, **names).answers
    for engine in ("pinocchio", "mujoco"):
        assert answers[engine].status is Status.NO_ASSEMBLY
        note = " ".join(answers[engine].notes)
        assert "with crank_angle held" in note and f"stays open by {scale * want:.3g} m" in note


def test_a_held_value_that_closes_is_closed() -> None:
    """Held at a value that it can have: nothing stays open, from a pose far from it too."""
    m = fourbar()
    for angle in (0.2, 1.5, 4.0):
        found = least_opening(m, {"crank": angle}, [m.reference()])
        assert found.closed
    assert not opening(m, m.reference() + 0.1).closed


def test_ball_joints_are_moved_too() -> None:
    """Of two chains between fixed points, one of fixed length: the slide is held beyond what the other reaches; no minimum is below 0,
    and none is above the gap of the pose from which it starts."""
    m = two_chains("spherical")
    q = m.reference()
    first = opening(m, q + 0.3 * np.eye(m.nq)[1])
    found = least_opening(m, {"p1": float(m.value("p1", q)) + 0.3}, [q])
    assert found.gap <= first.gap + 1e-12


def test_a_value_of_a_follower_that_no_pose_has_is_out_of_reach() -> None:
    """The rocker of a crank-rocker swings between the angles where crank and coupler stand in a line: held at the side of the ground it
    leaves a gap of ground + rocker - crank - coupler."""
    m = fourbar()  # crank .1, coupler .3, rocker .25, ground .3
    answer = engine_answer("mujoco", m, {"rocker": 0.0}, ["crank"])
    assert answer.status is Status.OUT_OF_REACH and not answer.values
    assert any(f"loop pin stays open by {0.3 + 0.25 - 0.1 - 0.3:.3g} m" in n for n in answer.notes)
