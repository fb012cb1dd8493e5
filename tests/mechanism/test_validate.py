"""Anything that is not sound raises at construction, and the message names the culprit."""

import subprocess
import sys
from dataclasses import replace
from fractions import Fraction

import pytest

from mechlab.errors import MechlabError
from mechlab.mechanism import (
    Body,
    Builder,
    Drive,
    Frame,
    Inertia,
    Joint,
    LinearRelation,
    Loop,
    Mechanism,
    Shaft,
    revolute,
)
from tests.mechanism.samples import fourbar

MASS = Inertia.cylinder(1.0, 0.05, 0.1)


def bodies(*changes: Body) -> Mechanism:
    return Mechanism("m", changes)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: bodies(), "no bodies"),
        (lambda: bodies(Body("a", "b", inertia=MASS)), "parent of body 'a'.*'b' does not exist"),
        (lambda: bodies(Body("a", "b", inertia=MASS), Body("b", "a", inertia=MASS)), "cycle"),
        (lambda: bodies(Body("a", inertia=MASS), Body("b", inertia=MASS), Body("c", "a", inertia=MASS)), "depth-first"),
        (lambda: bodies(Body("a", inertia=MASS), Body("a", inertia=MASS)), "'a' is used 2 times"),
        (lambda: bodies(Body("a", joints=(Joint("j"),))), "'a' moves but has no mass"),
        (
            lambda: bodies(Body("a", joints=(Joint("j", "helical"),), inertia=MASS)),
            "'helical' does not exist.*revolute",
        ),
        (lambda: bodies(Body("a", joints=(Joint("j", axis=(0, 0, 2)),), inertia=MASS)), "unit vector"),
        (lambda: bodies(Body("a", joints=(Joint("j", damping=-1.0),), inertia=MASS)), "damping.*>= 0"),
        (lambda: bodies(Body("a", joints=(Joint("j", damping=float("nan")),), inertia=MASS)), "damping"),
        (lambda: bodies(Body("a", joints=(Joint("j", range=(1.0, 0.0)),), inertia=MASS)), "low < high"),
        (lambda: bodies(Body("a b", inertia=MASS)), "letters, digits"),
        (lambda: Inertia(-1.0), "mass"),
        (lambda: Inertia(1.0, (0, 0, 0), (1.0, 1.0, 3.0, 0, 0, 0)), "triangle inequality"),
        (lambda: Inertia(1.0, (0, 0, 0), (1.0, -1.0, 1.0, 0, 0, 0)), "negative"),
        (lambda: Inertia(1.0, (float("nan"), 0, 0)), "centre of mass"),
        (lambda: replace(fourbar(), drives=(Drive("d", "crnk"),)), "'crnk' does not exist. Did you mean 'crank'"),
        (lambda: replace(fourbar(), frames=(Frame("f", "x"),)), "frame 'f'.*'x'"),
        (lambda: replace(fourbar(), loops=(Loop("l", "ball", "crank", "rocker"),)), "'ball' does not exist.*spherical"),
        (lambda: replace(fourbar(), loops=(Loop("l", "fixed", "crank", "crank"),)), "to itself"),
        (lambda: replace(fourbar(), relations=(LinearRelation("g", (("x", Fraction(1)),)),)), "relation 'g'.*'x'"),
    ],
)
def test_unsound_data_is_refused(build: object, message: str) -> None:
    with pytest.raises(MechlabError, match=message):
        build()  # type: ignore[operator]


def test_a_shaft_with_inertia_across_branches_is_refused_naming_both_joints() -> None:
    m = fourbar()
    terms = (("crank", Fraction(1)), ("rocker", Fraction(1)))
    with pytest.raises(MechlabError, match="'crank' and 'rocker' do not lie on one path"):
        replace(m, shafts=(Shaft("s", terms, inertia=0.1),))
    assert replace(m, shafts=(Shaft("s", terms),)).shafts[0].name == "s"


def test_unknown_names_list_what_exists() -> None:
    m = fourbar()
    with pytest.raises(MechlabError, match="Existing: coupler, crank, rocker"):
        m.row("motor")
    with pytest.raises(MechlabError, match="body 'x' does not exist"):
        m.body("x")


def test_the_builder_sorts_depth_first() -> None:
    b = Builder("m")
    b.body("c", revolute("c"), parent="a", inertia=MASS).body("b", revolute("b"), inertia=MASS).body(
        "a", revolute("a"), inertia=MASS
    )
    assert [x.name for x in b.build().bodies] == ["b", "a", "c"]


def test_a_mechanism_is_checked_whatever_was_imported_first():
    code = (
        "from mechlab.mechanism.model import Mechanism; from mechlab.errors import MechlabError\n"
        "try: Mechanism('empty', ())\n"
        "except MechlabError as error: print(error)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "has no bodies" in out.stdout
