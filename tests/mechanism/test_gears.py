"""Meshes as linear relations, against the Willis equation and the rolling of pitch circles worked out by hand."""

from fractions import Fraction

import pytest

from mechlab.errors import MechlabError
from mechlab.mechanism import Builder, GearMesh, Inertia, prismatic, revolute, structure
from tests.mechanism.samples import planetary

DISC = Inertia.cylinder(1.0, 0.05, 0.02)


def test_planetary_rows_are_willis() -> None:
    m = planetary(planets=1)
    inner, outer = (dict(r.coefficients) for r in m.relations)
    # z_s (w_s - w_c) = -z_p w_p with w_p counted from the carrier.
    assert inner == {"sun": 1, "carrier": -1, "planet_0": Fraction(30, 24)}
    assert outer == {"ring": 1, "carrier": -1, "planet_0": Fraction(-30, 84)}


def test_external_pair_turns_opposite_and_rack_rolls() -> None:
    b = Builder("pair")
    b.body("a", revolute("a"), inertia=DISC).body("b", revolute("b"), at=(0.1, 0, 0), inertia=DISC)
    b.body("r", prismatic("slide", "x"), at=(0, -0.02, 0), inertia=DISC)
    b.gears("mesh", "a", "b", (17, 29))
    b.mesh(GearMesh("roll", "a", "slide", "ground", "rack", pitch_radius="0.02"))
    mesh, roll = (dict(r.coefficients) for r in b.build().relations)
    assert mesh == {"a": 1, "b": Fraction(29, 17)}
    # A pinion that turns by +1 rad above the rack's pitch line moves its contact point by +r: slide = r a (contact below).
    assert roll == {"a": 1, "slide": -50}


def test_bevel_pair_at_right_angles() -> None:
    b = Builder("bevel")
    b.body("a", revolute("a", "z"), inertia=DISC).body("b", revolute("b", "x"), inertia=DISC)
    b.gears("mesh", "a", "b", (20, 40), kind="bevel")
    # Pitch point between +z and +x: a (z x p) is along +y, b (x x p) along -y: z_a a = -z_b b.
    assert dict(b.build().relations[0].coefficients) == {"a": 1, "b": 2}


def test_a_bevel_planet_keeps_the_carrier_term() -> None:
    """A differential: both side gears against a planet whose axis turns with the carrier: a + c = 2 carrier."""
    b = Builder("differential")
    for name in ("left", "carrier", "right"):
        b.body(name, revolute(name, "x"), inertia=DISC)
    b.body("planet", revolute("planet", "y"), parent="carrier", inertia=DISC)
    b.gears("l", "left", "planet", (30, 20), carrier="carrier", kind="bevel")
    b.gears("r", "right", "planet", (30, 20), carrier="carrier", kind="bevel", side=-1)
    left, right = (dict(r.coefficients) for r in b.build().relations)
    assert left["carrier"] == right["carrier"] == -1
    assert left["planet"] == -right["planet"] and abs(left["planet"]) == Fraction(2, 3)


def test_a_mesh_whose_axes_do_not_stand_in_its_carrier_is_refused() -> None:
    b = Builder("wrong")
    b.body("arm", revolute("arm"), inertia=DISC)
    b.body("a", revolute("a"), inertia=DISC)
    b.body("b", revolute("b"), parent="arm", at=(0.1, 0, 0), inertia=DISC)
    b.gears("mesh", "a", "b", (20, 30), carrier="ground")
    with pytest.raises(MechlabError, match="not constant.*stand fixed in carrier 'ground'"):
        b.build()


@pytest.mark.parametrize("teeth", [(24, 30, 85), (25, 30, 84)])
def test_inconsistent_redundant_meshes_are_refused_by_name(teeth: tuple[int, int, int]) -> None:
    b = Builder("stage")
    for name in ("sun", "carrier", "ring"):
        b.body(name, revolute(name), inertia=DISC)
    for k, (x, y) in enumerate(((1, 0), (-1, 0))):
        b.body(f"planet_{k}", revolute(f"planet_{k}"), parent="carrier", at=(x, y, 0), inertia=DISC)
    b.gears("inner_0", "sun", "planet_0", (24, 30), carrier="carrier")
    b.gears("outer_0", "ring", "planet_0", (84, 30), carrier="carrier", kind="internal")
    b.gears("inner_1", "sun", "planet_1", (teeth[0], 30), carrier="carrier")
    b.gears("outer_1", "ring", "planet_1", (teeth[2], 30), carrier="carrier", kind="internal")
    with pytest.raises(MechlabError, match=r"'inner_0'.*'outer_1'.*lock.*inconsistent"):
        b.build()


def test_a_long_train_has_the_exact_ratios_of_its_teeth() -> None:
    """120 external meshes in a row: each relation is z_a q_a + z_b q_b = 0, and the last wheel turns by the ratio of the ends."""
    teeth = [20 + k % 7 for k in range(121)]
    b = Builder("train")
    at = 0.0
    for k, z in enumerate(teeth):
        b.body(f"w{k}", revolute(f"w{k}", "z"), at=(at, 0.0, 0.0), inertia=Inertia.box(1.0, 0.1, 0.1, 0.01))
        at += 0.5e-3 * (z + teeth[min(k + 1, 120)])
    for k in range(120):
        b.gears(f"m{k}", f"w{k}", f"w{k + 1}", (teeth[k], teeth[k + 1]))
    m = b.build()
    turn = Fraction(1)
    for k, r in enumerate(m.relations):
        assert r.coefficients == ((f"w{k}", Fraction(1)), (f"w{k + 1}", Fraction(teeth[k + 1], teeth[k])))
        turn *= -r.coefficients[0][1] / r.coefficients[1][1]
    assert turn == Fraction(teeth[0], teeth[-1])
    found = structure(m)
    assert (found.nv, found.rank, found.freedoms, found.redundant) == (121, 120, 1, ())
