"""Portraits: order of the vectorized integration, files, figures; the verb `sweep --portrait`."""

import json
import math

import numpy as np
import pytest

from mechlab import api
from mechlab.cli import main
from mechlab.errors import MechlabError, Untrustworthy
from mechlab.kit.portrait import estimated_error, flow, grid, section


def pendulum(t, y):
    return np.stack([y[..., 1], -y[..., 0]], axis=-1)


def test_flow_is_of_fourth_order_and_many_are_as_one() -> None:
    start = np.random.default_rng(0).normal(size=(50, 2))
    errors = []
    for h in (0.1, 0.05):
        t, y = flow(pendulum, start, 3.0, h, 4)
        exact = start[:, 0] * math.cos(3.0) + start[:, 1] * math.sin(3.0)
        errors.append(np.abs(y[-1, :, 0] - exact).max())
    assert 3.8 < math.log2(errors[0] / errors[1]) < 4.2
    assert np.array_equal(flow(pendulum, start[7:8], 3.0, 0.05, 4)[1][:, 0], y[:, 7])
    assert np.allclose(t, [0, 1, 2, 3])
    assert 0.3 < estimated_error(pendulum, start, 3.0, 0.1, 50) / errors[0] < 3.0


def test_section_returns_to_its_start() -> None:
    points = section(pendulum, [[1.0, 0.0]], 2 * math.pi, 5, 200)
    assert points.shape == (6, 1, 2) and np.allclose(points, [1.0, 0.0], atol=1e-6)


def test_what_runs_away_is_an_error() -> None:
    with pytest.raises(Untrustworthy, match="finite"):
        flow(lambda t, y: y**3, [[100.0]], 10.0, 0.1, 3)
    with pytest.raises(MechlabError):
        flow(pendulum, [[1.0, 0.0]], -1.0, 0.1)


def test_grid_has_every_combination() -> None:
    points = grid({"a": [1, 2], "b": 5.0, "c": [1, 2, 3]})
    assert len(points["a"]) == 6 and set(points["b"]) == {5.0}


def test_exact_curves_are_those_of_the_integration() -> None:
    """Curves of the first integral, through the states that RK4 over psi finds."""
    from mechlab.analytic.impulse import first_integral
    from mechlab.catalog.impulse_transmission.build import Parameters
    from mechlab.catalog.impulse_transmission.portraits import exact, poincare

    p = Parameters(M0=0.0, M1=0.0)
    curves = exact(p, {"input_speed": 150.0}).arrays
    map_ = poincare(
        p, {"input_speed": 150.0, "beta_0": 0.0, "beta_rate_0": curves["beta_rate"][::8, 0], "turns": 4}
    ).arrays
    # M0 = 0: every curve closes after psi + 2 pi, but the last, which reaches the input speed and has no next crossing.
    assert np.allclose(map_["beta_rate"][:-1], map_["beta_rate"][:-1, :1], atol=1e-5)
    assert np.all(np.isnan(map_["beta_rate"][-1, 1:])) and np.isnan(curves["slip"][-1]).any()
    energy = first_integral(p.impulse, 150.0, curves["psi"], curves["slip"], 0.0)
    assert np.nanmax(np.abs(energy / curves["energy"][:, None] - 1.0)) < 1e-12


def test_sweep_writes_arrays_and_a_figure(tmp_path, capsys) -> None:
    words = (
        "sweep impulse_transmission --portrait phase M0=0 M1=0 c=500 beta_0=-.1:.1:3 beta_rate_0=-20:20:4 duration=.05"
    )
    assert main([*words.split(), "-o", str(tmp_path), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["curves"] == 12
    arrays = np.load(document["files"]["arrays"])
    assert len(arrays["beta"]) == 12 and np.allclose(sorted(set(arrays["beta"][:, 0].round(12))), [-0.1, 0.0, 0.1])
    # Dense enough for a smooth line: a loop of the curve is a turn of psi = 4/3 (alpha - beta).
    assert np.abs(np.diff(4.0 / 3.0 * (arrays["alpha"] - arrays["beta"]))).max() < 2.0 * np.pi / 40.0
    assert (tmp_path / "impulse_transmission-phase.png").stat().st_size > 5000


def test_bifurcation_changes_sign(tmp_path) -> None:
    found = api.portrait(
        "impulse_transmission", "bifurcation", input_speed=150.0, friction=[750.0], ratio=np.linspace(0, 0.1, 101)
    ).portrait
    mean = found.arrays["mean_speed"][0]
    assert mean[0] > 0 > mean[-1] and abs(np.interp(0.0, -mean, found.arrays["M0/M1"][0]) - 0.039) < 1e-3


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--portrait nothing", "phase"),
        ("--portrait phase zeta=1", "beta_0"),
        ("--portrait exact", "M1=0"),
        ("", "--portrait"),
    ],
)
def test_what_is_wrong_is_named(words, said, capsys) -> None:
    assert main(f"sweep impulse_transmission {words}".split()) in (1, 2)
    assert said in capsys.readouterr().err
