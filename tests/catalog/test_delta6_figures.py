"""Figures of chapter 5: the contact between the drawn teeth, and torques through all meshes in motion."""

import numpy as np
import pytest

from mechlab.analytic import delta6
from mechlab.catalog.delta6 import figures_mesh
from mechlab.catalog.delta6.elements import tooth_loss
from mechlab.catalog.delta6.figures import controlled


@pytest.mark.parametrize("phase", [0.02, 0.3, 0.7, 0.98])
def test_the_drawn_teeth_touch_where_the_force_acts(phase: float) -> None:
    """Both outlines come within a hundredth of a module of the beginning of the arrow."""
    panel = figures_mesh.film(phase).panels[0]
    driver, driven = panel.curves[:2]
    arrow = panel.curves[4]
    at = np.array([np.asarray(arrow.x)[0], np.asarray(arrow.y)[0]])
    for outline in (driver, driven):
        points = np.column_stack([outline.x, outline.y])
        points = points[np.isfinite(points).all(axis=1)]
        a, b = points[:-1], points[1:]
        ab = b - a
        share = np.clip(((at - a) * ab).sum(axis=1) / np.maximum((ab**2).sum(axis=1), 1e-30), 0.0, 1.0)
        assert np.linalg.norm(a + share[:, None] * ab - at, axis=1).min() < 0.01 * figures_mesh.MODULE


def test_the_reaction_leans_the_other_way_past_the_pitch_point() -> None:
    """By arctan f on both sides; the levers of figure 13 give the loss that statics of vectors finds."""
    leans = np.degrees([np.arctan2(*figures_mesh.reaction(s)) for s in (-0.01, 0.01)]) - 20.0
    np.testing.assert_allclose(sorted(leans), [-np.degrees(np.arctan(0.16)), np.degrees(np.arctan(0.16))], atol=1e-9)
    ratios = [r.ours for r in figures_mesh.figure_13().readings if "lever" in r.what]
    np.testing.assert_allclose(ratios, [tooth_loss(20, 20, 0.16, phase) for phase in ("approach", "recess")], atol=1e-12)


def test_losses_in_motion() -> None:
    """The largest loss of a mesh is that at the first contact, by statics of vectors; with equal shares nothing is beyond it, and the
    first mesh repeats with the pitch of its driven gear."""
    turn = np.linspace(0.0, 2.0 * np.pi / 34.0, 2001)
    last, shared = figures_mesh.mesh_losses(turn)
    for k, (driver, driven) in enumerate(figures_mesh.PAIRS):
        extreme = max(tooth_loss(driver, driven, 0.16, phase) for phase in ("approach", "recess"))
        assert last[:, k].max() == pytest.approx(extreme, abs=2e-5)  # the first sample after a contact begins
        assert 1.0 < shared[:, k].min() and shared[:, k].max() < extreme
    again, _ = figures_mesh.mesh_losses(turn[1:-1] + 2.0 * np.pi / 34.0)
    np.testing.assert_allclose(again[:, 0], last[1:-1, 0], atol=1e-9)


def test_the_controlled_head_starts_as_printed() -> None:
    """alpha, beta, gamma = .05, .1, .3 rad and .6, .8, .4 rad/s; much later it does what is wanted."""
    angles, rates = controlled(np.array([0.0, 12.0]))
    np.testing.assert_allclose([angles[0], rates[0]], [[0.05, 0.1, 0.3], [0.6, 0.8, 0.4]], atol=1e-12)
    wanted = delta6.source_targets(12.0)
    np.testing.assert_allclose(angles[1], wanted.angles, atol=1e-9)
    np.testing.assert_allclose(rates[1], wanted.rates, atol=1e-9)
