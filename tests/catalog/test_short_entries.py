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
from mechlab.kit.in_world import InWorld
from mechlab.kit.path_motion import ClosedMotion, EngineMotion
from mechlab.kit.train import Train
from mechlab.lab.own_mechanism import entry_of
from mechlab.mechanism import close, revolute, same_mode

SHORT = [name for name in catalog.NAMES if catalog.entry(name).outside]


def test_the_catalog_is_large_and_its_entries_are_short() -> None:
    assert len(catalog.NAMES) >= 100 and len(SHORT) >= 80
    lengths = {n: len(Path(catalog.__file__).with_name(f"{n}.py").read_text().splitlines()) for n in SHORT}
    long = {n: x for n, x in lengths.items() if x > 60}
    assert len(long) <= 0.05 * len(SHORT) and max(lengths.values()) <= 80, long


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
     ("lepelletier", {"front": (38, 71)}), ("stewart", {"height": 0.51}), ("goldberg", {"beta": 1.01}), ("five_link", {"toe": 0.01}),
     ("watt_governor", {"arm": 0.21}), ("compliant_fourbar", {"stiffness": 0.21})],
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


def test_an_overconstrained_loop_turns_all_around_without_a_false_change_of_mode() -> None:
    """Which rows of the Schatz linkage repeat others changes on its way: a fixed choice of rows loses rank where the loop does not."""
    m = catalog.entry("schatz").build(catalog.entry("schatz").parameters(), "full")
    t = np.linspace(0.5, 0.5 + 2 * np.pi, 13)
    for witness in ("pinocchio", "mujoco", "numpy"):
        q = None
        for x in t:
            goal = {"theta_1": float(x)}
            found = close(m, q, goal) if witness == "numpy" else engine(witness).assemble(m, goal, start=q)
            assert found.closed, (witness, x, found.status)
            q = found.q
        assert m.value("theta_6", q) == pytest.approx(np.arctan2(-np.cos(0.5), 2 * np.sin(0.5)) + 2 * np.pi, abs=1e-9)


def test_a_real_change_of_mode_is_still_seen_where_a_row_is_redundant() -> None:
    """A planar loop closed by a ball joint has a void row; the coupler's end has two places, left and right of the way to the rocker."""
    m, mirrored = (ml.load("fourbar", mode=k).mechanism() for k in (1, -1))
    q = m.reference()
    for joint in m.joints:
        q[m.q_slice[joint.name].start] = mirrored.zero(joint.name) - m.zero(joint.name)
    there = close(m, q)
    np.testing.assert_allclose(there.q, q, atol=1e-9)
    assert not same_mode(m, m.reference(), q, ["crank_angle"]) and same_mode(m, q, q, ["crank_angle"])


def test_the_force_of_even_motion_is_that_of_the_centrifugal_pendulum() -> None:
    """Huygens' pendulum: spin^2 = g / (length cos(angle)) needs no torque, a slower one weight x length sin(angle) (1 - share^2)."""
    w = InWorld("pendulum", 0.01, (0, 0, -9.81))
    w.link("shaft", revolute("spin", "z"), at=(0, 0, 0), to=[(0, 0, 0.1)])
    bob = (0.3 * np.sin(0.6), 0.0, -0.3 * np.cos(0.6))
    w.link("bar", revolute("angle", "-y", zero=0.6), at=(0, 0, 0), to=[bob], parent="shaft", mass_per_length=1e-9, ball=2.0)
    m, spin = w.drive("spin").drive("angle").build(), np.sqrt(9.81 / (0.3 * np.cos(0.6)))
    for share in (0.0, 0.5, 1.0):
        motion = EngineMotion("mujoco", m, {"spin": (0.0, share * spin), "angle": (0.6, 0.6)}, 3)
        expected = 2.0 * 9.81 * 0.3 * np.sin(0.6) * (1 - share**2)
        np.testing.assert_allclose(motion["angle_steady"], expected, atol=1e-8)
    with pytest.raises(MechlabError, match="do not turn evenly"):
        EngineMotion("mujoco", ml.load("fourbar").mechanism(), {"crank_angle": (0.0, 1.0)}, 3)["crank_angle_steady"]


def test_rates_of_a_closed_form_are_its_derivatives() -> None:
    motion = ClosedMotion.along({"t": (0.0, 2 * np.pi)}, lambda given: {"x": np.arctan2(np.sin(given["t"]), 2 * np.cos(given["t"]))}, 9)
    t = motion["t"]
    np.testing.assert_allclose(motion["x"], np.unwrap(np.arctan2(np.sin(t), 2 * np.cos(t))), atol=1e-12)
    np.testing.assert_allclose(motion["x_rate"], 2 * np.pi * 2 / (4 * np.cos(t) ** 2 + np.sin(t) ** 2), rtol=1e-10)


def test_families_and_words_of_the_list() -> None:
    steering = [r.name for r in TABLE if r.family == "steering"]
    assert steering and [r[0] for r in ml.list_entries(family="steering").rows] == steering
    assert [r[0] for r in ml.list_entries(search="Straight wheel").rows] == ["cardan_circles"]
    assert [r[0] for r in ml.list_entries(search="spherical eye").rows] == ["agile_eye"]
    assert ml.list_entries(search="no such words").rows == ()
    assert [r[0] for r in ml.list_entries(freedoms=6).rows] == ["hexa", "stewart", "head_6rss"]
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
