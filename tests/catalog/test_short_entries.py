"""Entries in the short form: the numbers from outside by every witness, faults that they feel, families and words of the list."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab import catalog
from mechlab.analytic.linkage import Linkage
from mechlab.catalog.table import TABLE
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.kit.path_motion import ClosedMotion, EngineMotion
from mechlab.kit.train import Train
from mechlab.lab.own_mechanism import entry_of

SHORT = [name for name in catalog.NAMES if catalog.entry(name).outside]


def test_the_catalog_is_large_and_its_entries_are_short() -> None:
    assert len(catalog.NAMES) >= 80 and len(SHORT) >= 60
    lengths = {n: len(Path(catalog.__file__).with_name(f"{n}.py").read_text().splitlines()) for n in SHORT}
    assert np.median(list(lengths.values())) <= 60 and max(lengths.values()) <= 80, lengths


@pytest.mark.parametrize("name", SHORT)
def test_every_witness_has_the_number_from_outside(name: str) -> None:
    """The formula stands in the entry, beside its source; what is measured comes from Pinocchio, MuJoCo and, if any, the closed form."""
    entry = catalog.entry(name)
    assert entry.family and entry.origin and entry.use and entry.sources
    p = entry.parameters()
    checks = {c.text: c for c in entry.checks}
    for number in entry.outside:
        values = checks[number.text].run(p).values
        assert {"pinocchio", "mujoco"} <= set(values)
        for witness, value in values.items():
            assert abs(value - number.expected(p)) <= number.tolerance, (number.text, witness, value, number.expected(p))


@pytest.mark.parametrize(
    ("name", "changed"),
    [("hoeken", {"rocker": 0.126}), ("peaucellier", {"side": 0.11}), ("bennett", {"alpha": 0.61}), ("cardan", {"angle": 0.61}),
     ("lepelletier", {"front": (38, 71)}), ("stewart", {"height": 0.51})],
)  # fmt: skip
def test_the_number_from_outside_feels_a_wrong_length(name: str, changed: dict) -> None:
    """What MuJoCo measures on another design misses the number of this one: a wrong length in a mechanism would be felt."""
    entry = catalog.entry(name)
    right, wrong = entry.parameters(), replace(entry.parameters(), **changed)
    checks = {c.text: c for c in entry.checks}
    found = [checks[o.text].run(wrong).values["mujoco"] for o in entry.outside]
    assert any(abs(x - o.expected(right)) > 10 * o.tolerance for x, o in zip(found, entry.outside, strict=True))


@pytest.mark.parametrize("gear", [1, 2, 4, 5, 6])
def test_all_gears_of_the_lepelletier_train_are_those_that_are_printed(gear: int) -> None:
    entry = catalog.entry("lepelletier")
    p = replace(entry.parameters(), gear=gear)
    printed = {1: 4.171, 2: 2.340, 4: 1.143, 5: 0.867, 6: 0.691}[gear]  # ZF 6HP26
    motion = EngineMotion("mujoco", entry.build(p, "full"), {"ring_1": (0.0, 1.0)}, 3)
    assert motion["ring_1_rate"][1] / motion["ring_2_rate"][1] == pytest.approx(printed, abs=6e-4)


def test_a_geared_link_turns_with_the_other_in_the_plane() -> None:
    """phase + ratio x angle, also where both hang on moving links; by the closed form and by differences."""
    chain = Linkage("geared").pivot("O", 0.0, 0.0).crank("a", "O", "A", 0.1).geared("b", "A", "B", 0.05, "a", -2, 0.3)
    t = np.linspace(0.2, 1.0, 9)
    motion = chain.solve(a=(t, 1.0, 0.0))
    np.testing.assert_allclose(motion.turns["b"].x, 0.3 - 2.0 * t, atol=1e-15)
    ahead, back = (chain.solve(a=t + h).points["B"].p for h in (1e-6, -1e-6))
    np.testing.assert_allclose(motion.points["B"].v, (ahead - back) / 2e-6, atol=1e-9)


def test_a_train_has_its_teeth_in_the_gaps_and_the_ratio_of_willis() -> None:
    t = Train("stage").wheel("sun", 24).wheel("ring", 84, ring=True)
    t.carrier("arm").planet("planet", "arm", 30, t.centres("sun", 30)).mesh_of("sun", "planet", "arm").mesh_of("ring", "planet", "arm")
    m = t.relation("held", ring=1).drive("sun").build()
    motion = EngineMotion("pinocchio", m, {"sun": (0.0, 1.0)}, 2)
    assert motion["sun_rate"][0] / motion["arm_rate"][0] == pytest.approx(1.0 + 84 / 24, rel=1e-12)
    # on the line of centres a tooth of one wheel stands in a gap of the other: half a pitch apart in all
    sun, planet = (next(b for b in m.bodies if b.name == n).shapes[0].parameters for n in ("sun", "planet"))
    pitches = -sun.get("phase", 0.0) / (2 * np.pi / 24) + (np.pi - planet["phase"]) / (2 * np.pi / 30)
    assert pitches % 1.0 == pytest.approx(0.5, abs=1e-9)


def test_unknown_quantities_of_a_motion_are_named() -> None:
    m = ml.load("fourbar").mechanism()
    with pytest.raises(MechlabError, match="quantity 'B_w' does not exist"):
        EngineMotion("mujoco", m, {"crank_angle": (0.0, 1.0)}, 2)["B_w"]
    with pytest.raises(MechlabError, match="closed form: quantity 'x'"):
        ClosedMotion({"y": np.zeros(2)})["x"]


def test_the_holding_force_is_the_change_of_the_potential_energy() -> None:
    """Virtual work: torque x rate = - weight . velocity; here by differences of the height of the common centre of mass."""
    entry = catalog.entry("toggle_press")
    p = entry.parameters()
    m = entry.build(p, "minimal")
    start = m.zero("crank_angle")
    motion = EngineMotion("mujoco", m, {"crank_angle": (start, start + 1.0)}, 3)

    def energy(at: float) -> float:
        q = EngineMotion("pinocchio", m, {"crank_angle": (start, at)}, 2).q[-1]
        plant = engine("numpy").plant(m).set(q, np.zeros(m.nv))
        return 9.81 * sum(s.mass * s.centre[2] for s in plant.masses())

    place, h = start + 0.5, 1e-5
    assert motion["crank_angle_force"][1] == pytest.approx((energy(place + h) - energy(place - h)) / (2 * h), rel=1e-6)


def test_families_and_words_of_the_list() -> None:
    steering = [r.name for r in TABLE if r.family == "steering"]
    assert steering and [r[0] for r in ml.list_entries(family="steering").rows] == steering
    assert [r[0] for r in ml.list_entries(search="Straight wheel").rows] == ["cardan_circles"]
    assert ml.list_entries(search="no such words").rows == ()
    assert [r[0] for r in ml.list_entries(freedoms=6).rows] == ["hexa", "stewart"]
    assert "cardan" in [r[0] for r in ml.list_entries(motion="spherical", freedoms=1).rows]
    with pytest.raises(MechlabError, match="no mechanism here has 5 freedoms; there are some with 1, 2, 3, 4, 6"):
        ml.list_entries(freedoms=5)
    with pytest.raises(MechlabError, match="motion 'planr' does not exist. Did you mean 'planar'"):
        ml.list_entries(motion="planr")  # type: ignore[arg-type]
    assert "no mechanism of this kind" in ml.list_entries(search="no such words").text()
    with pytest.raises(MechlabError, match="family 'steer' does not exist. Did you mean 'steering'"):
        ml.list_entries(family="steer")


def test_a_bare_mechanism_has_no_family() -> None:
    assert entry_of(ml.load("fourbar").mechanism()).family == ""
