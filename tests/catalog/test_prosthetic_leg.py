"""The leg against the numbers of its specification: 200 random states, the swing, the slides that it needs."""

import json

import numpy as np
import pytest

from mechlab import api
from mechlab.catalog.prosthetic_leg import ENTRY
from mechlab.catalog.prosthetic_leg.build import FREE, LEG, Parameters, Segment, body, build
from mechlab.catalog.prosthetic_leg.questions import engine_terms, own_terms, random_states, tree
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.experiment.entry import Verdict

# Specification of the leg, swing scene: pin 4.1.0 and an own RK4 at 2e-4 s agree in these digits.
END = dict(zip(LEG, [-1.225233471e-03, 1.082018120e-01, 1.044022850e-04, 8.684396522e-01, 1.177057726e-04,
                     -3.792332601e-03], strict=True))  # fmt: skip
END_RATES = dict(zip(LEG, [-1.55058185e-01, 8.09454156e-01, 9.37632300e-03, 4.39592942e00, 2.31420475e-03,
                           3.95472920e-01], strict=True))  # fmt: skip


@pytest.mark.parametrize("engine", ["pinocchio", "mujoco"])
def test_mass_bias_and_accelerations_of_nine_freedoms(engine):
    p = Parameters()
    m, t = build(p, "full"), tree(p, FREE["full"])
    q, v = random_states(200, 9)
    own = own_terms(t, q, v)
    for k in range(200):
        for mine, theirs in zip(own, engine_terms(engine, m, q[k], v[k]), strict=True):
            # Rounding; the accelerations times the condition of M: 1e-13 measured.
            assert np.abs(mine[k] - theirs).max() < 1e-12 * np.abs(mine[k]).max()


@pytest.mark.parametrize("engine", ["pinocchio", "mujoco", "analytic"])
def test_end_of_the_swing(engine):
    final = api.simulate("prosthetic_leg", scene="swing", engine=engine).final()
    for name in LEG:
        assert final[name] == pytest.approx(END[name], abs=1e-7)
        assert final[f"{name}_rate"] == pytest.approx(END_RATES[name], abs=5e-6)  # RK4 at 1 ms, 48 Hz slides


@pytest.mark.slow
def test_which_slides_the_swing_needs():
    said = api.solve("prosthetic_leg", swing_duration=0.45)
    # Specification: 2.7, 10.0, 12.0, 26.7 mm; travel of the thigh 1.0 mm.
    for witness in ("analytic", "pinocchio", "mujoco"):
        got = said[witness]
        assert [round(1e3 * got[f"lock_{n}_error"], 1) for n in ("thigh_shin", "hitch", "slides", "slides_ankle")] == [
            2.7, 10.0, 12.0, 26.7]  # fmt: skip
        assert round(1e3 * got["lock_slides_unloaded_error"]) == 22
        assert got["thigh_travel"] == pytest.approx(1.0e-3, abs=5e-5)
    assert said.max_difference < 1e-7  # two integrators
    assert "needs: hitch" in said.answers["analytic"].notes[0]


def test_free_motion_from_the_command_line(capsys):
    assert main(["solve", "prosthetic_leg", "hip=20deg", "knee=-10deg", "hip_rate=2", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert set(document["answers"]) == {"analytic", "pinocchio", "mujoco"}
    assert document["max_difference"] < 1e-12


def test_the_start_of_a_swing_is_given_by_initial_keys():
    run = api.simulate(
        "prosthetic_leg", hip_0=0.1, knee_0=-0.4, ankle_0=0.05, hip_rate_0=1.0, knee_rate_0=2.0, duration=0.01
    )
    start = {n: run.channel(n)[0] for n in (*LEG, "hip_rate", "knee_rate", "ankle_rate")}
    assert start == pytest.approx({"hitch": 0, "hip": 0.1, "thigh": 0, "knee": -0.4, "shin": 0, "ankle": 0.05,
                                   "hip_rate": 1.0, "knee_rate": 2.0, "ankle_rate": 0.0})  # fmt: skip


@pytest.mark.slow
def test_the_drop_carries_the_body():
    p = Parameters(slider_damping=1500.0)  # near the critical damping of body on hitch: at rest after 0.8 s
    run = api.simulate(
        "prosthetic_leg", scene="stance-drop", engine="pinocchio", duration=0.8, timestep=5e-4, slider_damping=1500.0
    )
    assert run.health.trusted
    # At rest each spring carries what stands above it: trunk, carriage and the upper half of the thigh on the thigh's.
    b = body(p)
    above = b.trunk.mass + b.hitch_mass + b.thigh.halves[0].mass
    assert -run.final()["thigh"] * p.C_thigh == pytest.approx(above * p.gravity, rel=0.02)


def test_a_split_segment_keeps_mass_centre_and_inertia():
    thigh = body(Parameters()).thigh
    first, second = thigh.halves
    com = 0.5 * (first.com + second.com)
    inertia = sum(s.inertia + s.mass * (s.com - com) ** 2 for s in (first, second))
    assert (com, inertia, first.mass + second.mass) == pytest.approx((thigh.com, thigh.inertia, thigh.mass), rel=1e-14)
    with pytest.raises(MechlabError, match="cannot be split"):
        _ = Segment(1.0, 1.0, 0.5, 0.01).halves


def test_fidelities():
    for level, free in FREE.items():
        assert {j.name for j in build(Parameters(), level).joints} == set(free)
    with pytest.raises(MechlabError, match="transition matrices run passive scenes"):
        api.simulate("prosthetic_leg", scene="stance-drop", engine="analytic")


@pytest.mark.slow
def test_claims_have_their_verdicts():
    verdicts = {c.id: c.test().verdict for c in ENTRY.claims}
    assert verdicts == {"T1": Verdict.HOLDS, "T2": Verdict.HOLDS_ONLY_IF, "T3": Verdict.HOLDS, "T4": Verdict.HOLDS_ONLY_IF,
                        "T5": Verdict.HOLDS, "T6": Verdict.HOLDS_ONLY_IF}  # fmt: skip


@pytest.mark.slow
def test_checks_pass():
    report = api.check("prosthetic_leg")
    assert report.exit_code == 0, report.text()
