"""`solve NAME X_rate=… X_force=… efficiency=…` on mechanisms of gears."""

import json
import math

import numpy as np
import pytest

from mechlab import api
from mechlab.cli import main
from mechlab.errors import MechlabError, NoSolution
from mechlab.mechanism import Builder, Mechanism, revolute
from tests.mechanism.trains import bevel_differential, closed_differential, disc, gearbox

ETA = 0.98


def test_planetary_stage_is_the_textbook_from_three_witnesses() -> None:
    a = api.solve("planetary_stage", sun_rate=100.0, sun_force=1.0)
    assert a.question == "power flow" and set(a.answers) == {"analytic", "pinocchio", "mujoco"}
    assert a["analytic"]["carrier_force"] == pytest.approx(-4.5, rel=1e-12)
    assert a.max_difference is not None and a.max_difference < 1e-10
    for engine in ("pinocchio", "mujoco"):
        assert {"carrier_rate", "carrier_force"} <= a[engine].keys()
    lossy = api.solve("planetary_stage", sun_rate=100.0, sun_force=1.0, efficiency=ETA)["analytic"]
    assert lossy["efficiency_forward"] == pytest.approx((1 + 3.5 * ETA**2) / 4.5, rel=1e-12)
    assert lossy["efficiency_backward"] == pytest.approx(4.5 / (1 + 3.5 / ETA**2), rel=1e-12)


def test_free_ring_needs_two_speeds_and_gives_two_torques() -> None:
    a = api.solve("planetary_stage", ring="free", sun_rate=100.0, ring_rate=0.0, sun_force=24.0)
    assert a["analytic"]["ring_force"] == pytest.approx(84.0, rel=1e-12)
    assert a["analytic"]["carrier_force"] == pytest.approx(-108.0, rel=1e-12)
    assert a.max_difference is not None and a.max_difference < 1e-9
    ring = next(x for x in a.answers["analytic"].details["members"] if x["member"] == "ring")
    assert ring["rate"] == 0.0  # exactly: a member given as held stands still


def test_wolfrom_of_the_catalog(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "wolfrom", "sun_rate=116", "sun_force=1", "efficiency=0.98", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["answers"]["analytic"]
    assert said["ring_rate"] == pytest.approx(1.0, rel=1e-12)
    assert said["efficiency_forward"] == pytest.approx(0.560, abs=5e-4)
    assert said["efficiency_backward"] == pytest.approx(0.236, abs=5e-4)
    assert said["rolling_over_input"] == pytest.approx(10.9, abs=0.05)
    assert said["self_locking"] is False and said["circulating"] > 116.0
    assert {m["mesh"] for m in said["meshes"]} == {"sun_planet_1", "held_ring_planet_1", "ring_planet_1"}
    assert said["losses"] == pytest.approx(116.0 * (1 - said["efficiency_forward"]), rel=1e-9)
    carrier = said["carriers"][0]
    assert carrier["taken_from_meshes"] == pytest.approx(carrier["given_to_meshes"], rel=1e-9)  # it is free


def test_a_poor_wolfrom_locks_itself() -> None:
    said = api.solve("wolfrom", sun_rate=116.0, sun_force=1.0, efficiency=0.9).answers["analytic"]
    assert said.values["efficiency_backward"] < 0.0 and said.details["self_locking"] is True
    assert any("self-locking" in n for n in said.notes)


def test_table_for_a_person(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "wolfrom", "sun_rate=1", "sun_force=1"]) == 0
    out = capsys.readouterr().out
    assert "rolling_power" in out and "coupling_power" in out and "power_to_carrier" in out


def loop_of_power() -> Mechanism:
    """Planetary 24/30/84, the ring geared to the sun through a countershaft at -1/5: recirculates 7/3 of the input."""
    b = Builder("recirculating", gravity=(0, 0, 0))
    for name in ("sun", "carrier", "ring"):
        b.body(name, revolute(name), inertia=disc(0.01))
    b.body("counter", revolute("counter"), at=(0.2, 0, 0), inertia=disc(0.01))
    b.body("planet", revolute("planet"), parent="carrier", at=(0, 0.1, 0), inertia=disc(0.01))
    b.gears("inner", "sun", "planet", (24, 30), carrier="carrier")
    b.gears("outer", "ring", "planet", (84, 30), carrier="carrier", kind="internal")
    b.gears("first", "sun", "counter", (20, 40))
    b.gears("second", "ring", "counter", (100, 40), kind="internal")
    return b.drive("sun").drive("carrier").build()


def test_circulating_power_by_hand() -> None:
    """P_ring / P_in = z_r rho / (z_s + z_r rho) = -16.8 / 7.2 with rho = -1/5 (torques 24 : 84 : -108)."""
    a = api.solve(loop_of_power(), sun_rate=10.0, sun_force=1.0)
    assert a["analytic"]["ring_rate"] == pytest.approx(-2.0, rel=1e-12)
    assert a["analytic"]["circulating"] == pytest.approx(10.0 * 16.8 / 7.2, rel=1e-9)
    assert a.max_difference is not None and a.max_difference < 1e-9


@pytest.mark.parametrize("eta", [1.0, 0.97])
def test_power_balances_on_every_mesh_of_a_moving_carrier(eta: float) -> None:
    """Torques of gear, planet and carrier from the mesh force alone (absolute, tangential force at radii), not from rows."""
    a = api.solve(closed_differential(1), H1_rate=100.0, H2_rate=50.0, H1_force=100.0, H2_force=-200.0, efficiency=eta)
    said = a.answers["analytic"]
    rates = {"H1": 100.0, "H2": 50.0, "block14": 200.0, "block36": 100.0 / 3}
    if (
        eta == 1.0
    ):  # table of the specification: the missing element takes 4000 W from block 14 and gives them to block 36
        torque = {x["member"]: x["torque"] for x in said.details["members"]}
        assert torque["block14"] == pytest.approx(-20.0, abs=1e-9) and torque["block36"] == pytest.approx(
            120.0, abs=1e-9
        )
    spin = {"p2_0": said.values["p2_0_rate"] + 100.0, "p5_0": said.values["p5_0_rate"] + 50.0} | rates
    assert spin["p2_0"] == pytest.approx(-300.0, rel=1e-9) and spin["p5_0"] == pytest.approx(12.5, rel=1e-9)
    assert len(said.details["meshes"]) == 4
    for m in said.details["meshes"]:
        torques = m["torques"] | {m["carrier"]: -sum(m["torques"].values())}  # no couple left over
        power = sum(x * spin[n] for n, x in torques.items())
        size = max(abs(x * spin[n]) for n, x in torques.items())
        assert power == pytest.approx(-m["loss"], abs=1e-10 * size)
        assert m["power_to_carrier"] == pytest.approx(torques[m["carrier"]] * spin[m["carrier"]], abs=1e-10 * size)


def test_equal_planets_share_equally() -> None:
    one = api.solve(closed_differential(1), H1_rate=3.0, H2_rate=1.0, H1_force=1.0, H2_force=0.0, efficiency=ETA)
    three = api.solve(closed_differential(3), H1_rate=3.0, H2_rate=1.0, H1_force=1.0, H2_force=0.0, efficiency=ETA)
    assert three["analytic"]["block36_force"] == pytest.approx(one["analytic"]["block36_force"], rel=1e-9)
    rolling = [m["rolling_power"] for m in three.answers["analytic"].details["meshes"] if m["mesh"].startswith("m12")]
    assert np.ptp(rolling) < 1e-9 and any("share" in n for n in three.answers["analytic"].notes)


def test_bevel_differential_halves_the_torque() -> None:
    a = api.solve(bevel_differential(), cage_rate=2.0, left_rate=3.0, cage_force=10.0)
    assert a["analytic"]["right_rate"] == pytest.approx(1.0, rel=1e-12)
    assert [a["analytic"][f"{n}_force"] for n in ("left", "right")] == pytest.approx([-5.0, -5.0], rel=1e-12)


def test_gearbox_on_fixed_axes_and_arrays() -> None:
    rates = np.array([1.0, 2.0, 5.0])
    a = api.solve(gearbox(), a_rate=rates, a_force=1.0, b_force=0.0, efficiency=0.95)["analytic"]
    assert a["c_rate"] == pytest.approx(-rates / 6, rel=1e-12)  # c counts about -z
    assert a["c_force"] == pytest.approx(6 * 0.95**2 * np.ones(3), rel=1e-12)
    assert a["efficiency_backward"] == pytest.approx(0.95**2 * np.ones(3), rel=1e-12)
    one = api.solve(gearbox(), a_rate=1.0, a_force=1.0, b_force=0.0, ab_efficiency=0.9)["analytic"]
    assert one["efficiency_forward"] == pytest.approx(0.9, rel=1e-12) and math.isclose(one["circulating"], 0.0)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"a_rate": 1.0, "a_force": 1.0}, "torques of b, c are open, but 1 can be found"),
        ({"a_force": 1.0, "b_force": 0.0}, "1 speeds fix the train, 0 given"),
        ({"a_rate": 1.0, "efficiency": 0.9}, "give a torque other than 0"),
        ({"a_rate": 1.0, "a_force": 1.0, "b_force": 0.0, "efficiency": 1.5}, "above 0 and up to 1"),
        ({"a_rate": 1.0, "x_force": 1.0}, "'x_force' does not exist"),
        ({"a_rate": 1.0, "a_force": 1.0, "ac_efficiency": 0.9}, "Did you mean 'a[bc]_efficiency'|does not exist"),
    ],
)
def test_bad_questions_say_what_to_give(keys: dict[str, float], words: str) -> None:
    with pytest.raises(MechlabError, match=words):
        api.solve(gearbox(), **keys)


def test_speeds_that_contradict_the_teeth_have_no_solution() -> None:
    with pytest.raises(NoSolution, match="contradict the teeth"):
        api.solve(gearbox(), a_rate=1.0, c_rate=1.0, a_force=1.0, b_force=0.0)


def test_a_linkage_has_no_power_flow() -> None:
    with pytest.raises(MechlabError, match="no fidelity of it.*gear relations"):
        api.solve("fourbar", crank_rate=1.0, crank_force=1.0)
