"""The lag of soft gear rows from the command line: prediction, measurement, rigid loads; what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mechlab import api
from mechlab.cli import main
from mechlab.mechanism import Builder, revolute
from tests.mechanism.trains import disc


def asked(capsys, *keys, code=0):
    assert main(["solve", *keys, "--json"]) == code
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(("ratio", "first"), [(1, 1e-6), (1000, 1e-6), (10, 1e-4)])
def test_law_of_one_row(ratio, first):
    """Specification 3.3: r = (1 - d) tc^2 A f with A = 1/J1 + N^2/J2 and f = torque (1/J1) / A, for two gears at rest."""
    b = Builder("pair", gravity=(0, 0, 0))
    b.body("a", revolute("a"), inertia=disc(first)).body("b", revolute("b"), at=(0.1, 0, 0), inertia=disc(1.0))
    b.gears("mesh", "a", "b", (1, ratio))
    m = b.build()
    torque, row = 0.3, np.array([1.0, ratio])  # the sum that gears(a, b, (1, N)) holds: a + N b
    np.testing.assert_allclose(m.coefficient_row(m.relations[0].coefficients), row)
    a = row @ (row / np.array([first, 1.0]))
    f = torque / first / a
    found = api.solve(m, a_force=torque, row_timeconst=[5e-3, 20e-3], row_impedance=0.95)
    wanted = 0.05 * np.array([5e-3, 20e-3]) ** 2 * a * f
    np.testing.assert_allclose(found["analytic"]["mesh_lag"], wanted, rtol=1e-12)
    np.testing.assert_allclose(found["mujoco"]["mesh_lag"], wanted, rtol=1e-3)  # what remains of the onset
    for witness in ("analytic", "pinocchio"):
        np.testing.assert_allclose(found[witness]["mesh_load"], f, rtol=1e-12)
    np.testing.assert_allclose(found["mujoco"]["mesh_load"], f, rtol=1e-3)
    assert "mesh_lag" not in found["pinocchio"]


@pytest.mark.parametrize("name", ["closed_differential", "planetary", "planetary_stage", "wolfrom"])
def test_trains_of_the_catalog(capsys, name):
    member = {"closed_differential": "H1"}.get(name, "sun")
    document = asked(capsys, name, f"{member}_force=20", "row_impedance=0.9999", "row_timeconst=2ms")
    said = document["answers"]
    lags = [k for k in said["analytic"] if k.endswith("_lag")]
    assert lags and document["question"] == "lag of soft rows"
    largest = max(said["analytic"][k] for k in lags)
    for k in lags:
        assert said["mujoco"][k] == pytest.approx(said["analytic"][k], abs=1e-3 * largest)
        load = k.replace("_lag", "_load")
        assert said["mujoco"][load] == pytest.approx(said["pinocchio"][load], rel=1e-3)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (["fourbar", "row_impedance=0.9"], "no fidelity of it (kinematic, minimal) consists of gear relations alone"),
        (["planetary", "row_impedance=0.9"], "give a load other than 0, for example carrier_force=1"),
        (["planetary", "row_impedance=2", "sun_force=1"], "row_impedance: expected a number between 0 and 1"),
        (["planetary", "row_timeconst=0", "sun_force=1"], "row_timeconst: expected more than 0 s"),
        (["planetary", "row_timeconst=1ms", "sn_force=1"], "Did you mean 'sun_force'"),
    ],
)
def test_what_is_refused(capsys, keys, said):
    assert main(["solve", *keys]) == 1
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1


def test_show_lists_what_every_train_can_be_asked(capsys):
    assert main(["show", "closed_differential"]) == 0
    shown = capsys.readouterr().out
    assert "how far soft gear rows lag" in shown and "power through every mesh" in shown
