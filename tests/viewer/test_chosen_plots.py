"""The plots of a run show what the mechanism is for, without rounding; each curve is a recorded channel."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from mechlab import api, catalog
from mechlab.experiment.recording import Recording
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute
from mechlab.viewer.chosen_plots import NOISE, chosen_plots, snapped


@cache
def run(name: str) -> Recording:
    return api.simulate(name)


def curves(name: str) -> dict[str, tuple[str, np.ndarray]]:
    """Series of all plots of a run: name -> (title, values)."""
    story = api.story(run(name))
    return {n: (p.title, v) for p in story.plots for n, v in p.series.items()}


@pytest.mark.parametrize(
    ("name", "output"),
    [
        ("closed_differential", "H2_rate"),
        ("planetary", "carrier_rate"),
        ("impulse_transmission", "beta"),
        ("fourbar", "rocker_angle"),
        ("quick_return", "D_slide"),
        ("wolfrom", "ring_rate"),
        ("delta6", "O_x"),
    ],
)
def test_the_output_is_plotted(name: str, output: str) -> None:
    assert output in curves(name)


def test_every_channel_of_a_recipe_exists() -> None:
    """In a run of the default scene, so that no plot is left out for a misspelt name."""
    for name in catalog.NAMES:
        recipes = catalog.entry(name).plots
        if not recipes:
            continue
        recording = api.simulate(name, duration=0.02)
        for recipe in recipes:
            for channel in (*recipe.channels, *filter(None, [recipe.over])):
                assert channel in recording.channels, (name, recipe.title)
            units = {recording.units[c] for c in recipe.channels}
            assert len(units) == 1, (name, recipe.title)


def test_the_ratio_is_that_of_the_teeth() -> None:
    """Willis: 1 + z4 / z1 for the planetary gear with series planets, from its default teeth."""
    p = catalog.entry("planetary").parameters()
    title, ratio = curves("planetary")["sun_rate / carrier_rate"]
    assert title == "transmission ratio"
    assert np.isnan(ratio[0])  # both stand still
    np.testing.assert_allclose(ratio[1:], 1 + p.teeth[3] / p.teeth[0], rtol=1e-6)


def test_rounding_is_drawn_as_zero_and_kept_in_the_data() -> None:
    """A drive that needs no force at first: 1e-13 N m beside 5 N m."""
    recording = run("gear_linkage")
    recorded = recording.channels["crank_angle_force"]
    small = np.abs(recorded) < NOISE * np.abs(recorded).max()
    _, drawn = curves("gear_linkage")["crank_angle_force"]
    assert 0.0 < abs(recorded[0]) < 1e-12 and drawn[0] == 0.0 and small[0]
    np.testing.assert_array_equal(snapped({"a": recorded})["a"][~small], recorded[~small])
    kept = snapped({"a": np.array([1.0, np.nan, 2e-9, 0.9e-9]), "b": np.array([np.inf, 1e-12, 0.0, 1.0])})
    np.testing.assert_array_equal(kept["a"], [1.0, np.nan, 2e-9, 0.0])
    np.testing.assert_array_equal(kept["b"], [np.inf, 0.0, 0.0, 1.0])


def driven_pair() -> Mechanism:
    """A driven arm and, at the frame, one that hangs freely; their points stay in a plane."""
    b = Builder("pair")
    heavy = Inertia(mass=0.1, com=(0.1, 0.0, 0.0), tensor=(1e-4, 4e-4, 4e-4, 0.0, 0.0, 0.0))
    b.body("arm", revolute("arm_angle", "y"), inertia=heavy)
    b.body("follower", revolute("follower_angle", "y"), at=(0.5, 0.0, 0.0), inertia=heavy)
    b.frame("tip", "arm", at=(0.2, 0.0, 0.0))
    b.drive("arm_angle", stiffness=10.0, damping=1.0)
    return b.build()


def test_mechanisms_without_an_entry_show_drives_outputs_and_moving_directions() -> None:
    recording = api.simulate(driven_pair, duration=0.5)
    plots = {p.title: list(p.series) for p in chosen_plots(recording, np.arange(len(recording.t)))}
    assert plots == {
        "rotary drives": ["arm_angle"], "torques of rotary drives": ["arm_angle_force"],
        "outputs": ["follower_angle"], "points": ["tip_x", "tip_z"],
    }  # fmt: skip
