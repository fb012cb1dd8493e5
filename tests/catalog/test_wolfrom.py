"""The Wolfrom entry: its checks, its fidelities against each other, what it refuses."""

import numpy as np
import pytest

from mechlab import api
from mechlab.catalog import wolfrom
from mechlab.errors import MechlabError
from mechlab.mechanism import structure

SLIP = 5e-5
"""Of the soft rows, at the sun: the predicted lag is 6e-6 rad at the first joint of a row, up to 6 times that at the sun."""


def test_all_checks_pass() -> None:
    report = api.check("wolfrom")
    assert report.exit_code == 0 and len(report.outcomes) == 12, report.text()


@pytest.mark.parametrize("teeth", [(22, 44, 110, 44, 116), (11, 22, 55, 22, 58), (24, 30, 84, 27, 78)])
def test_checks_pass_for_other_teeth(teeth: tuple[int, ...]) -> None:
    report = api.check("wolfrom", {"teeth": teeth, "J_planet": 3e-6})
    assert report.exit_code == 0, report.text()


def test_fidelities_have_one_freedom_and_the_ratio() -> None:
    p = wolfrom.Parameters()
    assert p.ratio == 116
    for fidelity, nv, rows in (("minimal", 1, 0), ("parts", 4, 3), ("full", 6, 9)):
        m = wolfrom.build(p, fidelity)
        s = structure(m)
        assert (m.nv, len(m.relations), s.freedoms) == (nv, rows, 1)
    m = wolfrom.build(p, "minimal")
    assert m.row("sun")[0] / m.row("ring")[0] == pytest.approx(116.0, rel=1e-15)


def test_runs_of_all_fidelities_and_engines_agree() -> None:
    ends = {}
    for fidelity in ("minimal", "parts", "full"):
        for engine in ("mujoco", "pinocchio"):
            run = api.simulate("wolfrom", engine=engine, fidelity=fidelity, duration=0.2)
            assert run.health.exit_code == 0
            ends[engine, fidelity] = [run.channel("sun")[-1], run.channel("planet_1")[-1], run.channel("ring")[-1]]
    expected = api.simulate("wolfrom", engine="analytic", duration=0.2)
    wanted = [expected.channel("sun")[-1], expected.channel("planet_1")[-1], expected.channel("ring")[-1]]
    for (engine, fidelity), got in ends.items():
        # RK4 is exact for a constant acceleration; MuJoCo's soft rows slip by SLIP.
        assert np.allclose(got, wanted, rtol=1e-9, atol=SLIP if engine == "mujoco" and fidelity != "minimal" else 1e-9)


def test_the_slip_is_the_predicted_one() -> None:
    health = api.simulate("wolfrom", fidelity="parts", duration=0.1).health
    measured = health.finding("relation_residual").value
    assert measured == pytest.approx(health.finding("predicted_lag").value, rel=0.01) and measured < 1e-5


@pytest.mark.parametrize("fidelity", ["minimal", "parts", "full"])
def test_expand_gives_all_parts(fidelity: str) -> None:
    p = wolfrom.Parameters()
    recording = api.simulate("wolfrom", fidelity=fidelity, duration=0.1)
    full, q = wolfrom.expand(p, recording)
    assert q.shape == (len(recording.t), full.nq)
    for name in ("sun", "carrier", "ring", "planet_1"):
        assert np.allclose(full.value(name, q), recording.channel(name), atol=SLIP)
    gap = np.array([full.coefficient_row(r.coefficients) @ q.T for r in full.relations])
    assert np.max(np.abs(gap)) < SLIP


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"teeth": (22, 44, 111, 44, 116)}, "the held ring needs 110 teeth"),
        ({"teeth": (22, 44, 110, 44, 110)}, "stands still"),
        ({"teeth": (22, 44, 110, 44, 40)}, "more teeth than planet 2"),
        ({"teeth": (22, 44, 110, 44, 115)}, "fits the held ring but not the output ring"),
        ({"planets": 5}, "equal angles"),
        ({"planets": 6}, "overlap"),
    ],
)
def test_impossible_trains_are_refused(values: dict[str, object], words: str) -> None:
    with pytest.raises(MechlabError, match=words):
        api.load("wolfrom", **values)
