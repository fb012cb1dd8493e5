"""What users give to the Builder: text with units is read, anything else that is no number is named."""

import math

import pytest

import mechlab as ml
from mechlab.errors import MechlabError
from mechlab.shapes import KINDS


def test_text_with_units_is_the_number() -> None:
    plain = ml.Builder("a").bar("x", ml.revolute("j", range=(-math.pi / 2, 1)), 0.1, mass=0.2, at=(0, 0.05, 0))
    text = ml.Builder("a").bar("x", ml.revolute("j", range=("-90deg", "1rad")), "100mm", mass="200g", at=(0, "5cm", 0))
    assert text.build() == plain.build()
    assert ml.shape("cylinder", radius="10mm", length=0.1) == ml.shape("cylinder", radius=0.01, length="10cm")


def test_text_with_units_is_the_mass_and_the_size_of_a_part() -> None:
    assert ml.Inertia.cylinder("200g", "30mm", "1cm") == ml.Inertia.cylinder(0.2, 0.03, 0.01)
    assert ml.Inertia.box("1kg", "1cm", 0.02, "30mm") == ml.Inertia.box(1.0, 0.01, 0.02, 0.03)
    assert ml.Inertia.rod("1kg", (0, 0, 0), (1, 0, 0), "2mm") == ml.Inertia.rod(1.0, (0, 0, 0), (1, 0, 0), 0.002)
    assert ml.Inertia.point("5g").mass == 0.005


def test_a_guess_that_looks_like_degrees_is_remarked_and_one_name_may_be_held() -> None:
    b = ml.Builder("m").bar("link", ml.revolute("j"), 1.0)
    with pytest.warns(UserWarning, match=r"guess j = 60 rad is 9.5 turns; if degrees are meant, write j=60deg") as told:
        b.assemble({"j": 60}, hold="j")
    assert told[0].filename == __file__
    assert ml.Builder("m").bar("link", ml.revolute("j"), 1.0).assemble({"j": 1.0}, hold=None).zero("j") == 1.0


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (lambda b: b.bar("x", ml.revolute("k"), "100kg"), r"bar 'x': length: expected a number \[m\], got '100kg'"),
        (lambda b: b.bar("x", ml.revolute("k"), None), r"bar 'x': length: expected a number in m, got None"),
        (lambda b: b.bar("x", ml.revolute("k"), -1.0), r"length must be positive, got -1.0 m"),
        (lambda b: b.bar("x", "k", 1.0), r"bar 'x': expected a joint such as revolute"),
        (lambda b: b.bar("x", ml.revolute("k", lenght=3), 1.0), r"joint 'k': option 'lenght' does not exist"),
        (lambda b: b.bar("x", ml.revolute("k", range=3), 1.0), r"range: expected two numbers \(low, high\) in rad"),
        (lambda b: b.bar("x", ml.revolute("k"), 1.0, color="red"), r"color: expected \(red, green, blue, alpha\)"),
        (lambda b: b.bar("link", ml.revolute("k"), 1.0), r"body 'link' exists already"),
        (lambda b: b.body("x", ml.revolute("k"), inertia=3), r"body 'x': inertia: expected an Inertia"),
        (lambda b: b.body("x", ml.revolute("k"), at=(0, 1)), r"body 'x': at: expected three numbers"),
        (lambda b: b.spring("s"), r"expected a Spring"),
        (lambda b: b.gears("g", "j", "k", 3), r"expected two tooth counts \(of 'j', of 'k'\)"),
        (lambda b: b.shaft("s", {"j": 1}, inertai=3), r"option 'inertai' does not exist. Did you mean 'inertia'"),
        (lambda b: b.assemble({"j": "5mm"}), r"guess of 'j': expected a number \[rad\]"),
        (lambda b: ml.shape("cilinder", radius=1), r"shape kind 'cilinder' does not exist. Did you mean 'cylinder'"),
        (lambda b: ml.shape("cylinder", radios=1), r"parameter 'radios' does not exist. Did you mean 'radius'"),
        (lambda b: ml.shape("cylinder", radius=1), r"cylinder: missing length"),
        (lambda b: ml.shape("cylinder", radius=-1, length=1), r"radius must be greater than 0 m"),
        (lambda b: ml.Inertia("1m"), r"mass: expected a number \[kg\], got '1m'"),  # type: ignore[arg-type]
        (lambda b: ml.Inertia.cylinder("1kg", -0.1, 1), "radius must be at least 0, got -0.1 m"),
        (lambda b: b.spring(ml.Spring("s", "ground", "ground", ("1mm", 0, 0))).build(), "point_a: expected three numbers"),  # type: ignore[arg-type]
        (lambda b: ml.Sine("20deg", 1.0), "Sine: amplitude: expected a number in SI units, got '20deg'"),  # type: ignore[arg-type]
        (lambda b: ml.Inertia(1.0, (0, 0, 0), 3.0), r"inertia tensor: expected six finite numbers"),  # type: ignore[arg-type]
    ],
)  # fmt: skip
def test_a_wrong_value_is_named(work: object, words: str) -> None:
    with pytest.raises(MechlabError, match=words):
        work(ml.Builder("m").bar("link", ml.revolute("j"), 1.0))  # type: ignore[operator]


def test_the_plate_takes_as_many_pins_as_its_solid() -> None:
    from mechlab.mechanism import links
    from mechlab.shapes import links as drawn

    assert links.MOST_PINS == drawn.MOST_PINS
    assert f"x_{drawn.MOST_PINS}" in {p.name for p in KINDS["plate_link"].parameters}
