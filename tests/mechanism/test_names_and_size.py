"""Names that would mean two things, and mechanisms of all sizes: a four-bar must not know its unit of length."""

import math
import re

import numpy as np
import pytest

import mechlab as ml
from mechlab.errors import MechlabError
from mechlab.formats import from_mjcf
from mechlab.mechanism.builder import Builder
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.parts import MAX_BODIES, floating, prismatic, revolute, spherical

BALL = Inertia(1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
CRANK, COUPLER, ROCKER, BASE = 0.1, 0.4, 0.3, 0.35


def fourbar(size: float) -> ml.Mechanism:
    """Planar four-bar with gravity in proportion to its size, so that it moves the same at every size."""
    b = Builder("fb", gravity=(0.0, -9.81 * size, 0.0))
    b.bar("crank", revolute("a"), CRANK * size)
    b.bar("coupler", revolute("c"), COUPLER * size, parent="crank", at=(CRANK * size, 0, 0))
    b.bar("rocker", revolute("r"), ROCKER * size, at=(BASE * size, 0, 0))
    b.loop("pin", "coupler", "rocker", (COUPLER * size, 0, 0), (ROCKER * size, 0, 0), kind="revolute")
    return b.assemble({"a": 1.0, "c": -0.3, "r": 1.3}, hold=["a"])


def rocker(a: float) -> float:
    """Freudenstein's closed form of the rocker angle, the mode of the reference pose."""
    x, y = CRANK * math.cos(a) - BASE, CRANK * math.sin(a)
    d = math.hypot(x, y)
    return math.atan2(y, x) - math.acos((ROCKER**2 + d**2 - COUPLER**2) / (2 * ROCKER * d))


@pytest.mark.parametrize("size", [1e-8, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9])
def test_a_four_bar_of_any_size_solves_like_the_closed_form(size):
    answers = ml.solve(fourbar(size), a=2.0)
    for witness in ("pinocchio", "mujoco"):
        assert answers.answers[witness].status.exit_code == 0
        # 1e-11: rounding of a loop of order 1, whatever its unit of length
        assert abs(math.remainder(answers[witness]["r"] - rocker(2.0), 2 * math.pi)) < 1e-11


@pytest.mark.parametrize("size", [1e-6, 1e6])
def test_a_run_in_pinocchio_does_not_depend_on_the_size(size):
    run, usual = (ml.simulate(fourbar(s), engine="pinocchio", duration=0.5) for s in (size, 1.0))
    assert run.health.trusted
    # RK4 at 1 ms: the same steps, up to rounding that grows along the run
    assert abs(run.final()["a"] - usual.final()["a"]) < 1e-8


def test_masses_that_mujoco_cannot_hold_are_an_error():
    run, true = (ml.simulate(fourbar(1e-3), engine=e, duration=1.0) for e in ("mujoco", "pinocchio"))
    assert abs(run.final()["a"] - true.final()["a"]) > 1e-2  # MuJoCo's floor of 1e-15 kg m2 makes the links heavier
    assert not run.health.trusted and true.health.trusted


@pytest.mark.parametrize("size", [1e-12, 1e14])
def test_sizes_beyond_the_limits_are_refused(size):
    with pytest.raises(MechlabError, match="its size is"):
        fourbar(size)


def two(first: str, second: str) -> ml.Mechanism:
    b = Builder("two")
    b.bar("l", revolute(first), 1.0)
    return b.bar("k", revolute(second), 1.0, parent="l", at=(1.0, 0, 0)).build()


@pytest.mark.parametrize("suffix", ["_rate", "_accel", "_force", "_0", "_rate_0"])
def test_joints_that_make_one_key_are_refused_with_both_meanings(suffix):
    with pytest.raises(MechlabError, match=re.escape(f"'a{suffix}' would mean")):
        two("a", f"a{suffix}")
    assert two("flow_rate", "b").scalar_names == ("flow_rate", "b")


def test_a_frame_may_be_called_as_the_slides_that_carry_it_and_no_other():
    b = Builder("free").body("p", *floating("p"), inertia=BALL)
    assert b.frame("p", "p").build().frames[0].name == "p"
    b.frames.clear()
    with pytest.raises(MechlabError, match="'p_x' would mean"):
        b.frame("p", "p", at=(0.1, 0.0, 0.0)).build()


def test_a_spherical_joint_owns_the_names_of_its_rates():
    b = Builder("s").body("a", spherical("ball"), inertia=BALL)
    b.body("b", prismatic("ball_x"), parent="a", inertia=BALL)
    with pytest.raises(MechlabError, match="'ball_x' would mean"):
        b.build()


def test_a_parameter_called_as_a_joint_is_refused():
    def arm(q: float = 1.0) -> ml.Mechanism:
        return Builder("arm").bar("link", revolute("q"), q).build()

    with pytest.raises(MechlabError, match="would mean the parameter 'q' and the value of joint 'q'"):
        ml.load(arm).mechanism()

    def two_arms(p: float = 1.0, q: float = 1.0) -> ml.Mechanism:
        return Builder("arm").bar("upper", revolute("q"), q).bar("lower", revolute("p"), p, parent="upper").build()

    with pytest.raises(MechlabError, match="q=.* value of joint 'q'; p=.* value of joint 'p': give one of each another name"):
        ml.load(two_arms).mechanism()


def test_a_site_of_a_file_that_would_collide_gets_another_name():
    text = """<mujoco><worldbody><body name="b"><joint name="tip_x" type="hinge" axis="0 1 0"/><geom size=".1" mass="1"/>
    <site name="tip" pos=".3 0 0"/></body></worldbody></mujoco>"""
    assert [f.name for f in from_mjcf(text).frames] == ["tip_site"]


def test_names_of_bodies_that_never_ended():
    with pytest.raises(MechlabError, match="cannot be called 'ground'"):
        Builder("x").bar("ground", revolute("q"), 1.0).build()
    with pytest.raises(MechlabError, match="more than once"):
        Builder("x").bar("a", revolute("q"), 1.0).bar("a", revolute("r"), 1.0, parent="a").build()
    with pytest.raises(MechlabError, match="form a cycle"):
        Builder("x").bar("a", revolute("q"), 1.0, parent="a").build()


def test_the_number_of_bodies_is_limited_before_they_are_made():
    b = Builder("many")
    with pytest.raises(MechlabError, match=f"more than {MAX_BODIES} bodies"):
        for k in range(MAX_BODIES + 1):
            b.body(f"b{k}")


def test_a_gear_of_a_billion_teeth_is_drawn_with_fewer_on_the_same_pitch_circle():
    from mechlab.shapes import mesh

    many = mesh("spur_gear", {"teeth": 1_000_000_000, "module": 1e-9, "width": 0.01})
    assert abs(np.abs(many.vertices[:, :2]).max() - 0.5) < 2e-3  # pitch radius 0.5 m and a tooth of module 0.5 mm
