"""Checks A1, A2, A6, A10: numbers of the source, always with the source's parameters."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.elements import tooth_loss, tooth_sliding
from mechlab.catalog.delta6.masses import vec
from mechlab.catalog.delta6.parameters import ANGLES, CENTRE, HEAD_POSE, ROTARY, SLIDERS, SOURCE, Delta6Parameters, legs
from mechlab.catalog.delta6.poses import plants, response
from mechlab.engines.protocol import StatePlant
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit.checked_quantities import CheckedQuantity, check_quantities
from mechlab.mechanism import TreeKinematics
from mechlab.mechanism.geometry import Array

Names = tuple[str, ...]


def a1(p: Delta6Parameters) -> CheckResult:
    """The source's velocity example of the translation."""
    geom, home, ones = SOURCE.geometry, np.zeros(3), np.ones(3)
    rows, _ = closed.implicit_matrices(geom, home)
    rates = closed.slider_rates(geom, home, ones), closed.platform_velocity(geom, home, ones)
    values = {"analytic": np.concatenate([*rates, rows.ravel()])}
    values |= {name: _translation(w) for name, w in plants(build(SOURCE, "minimal")).items()}
    expected = [1.27086, 1.79385, -0.06471, 0.0, 0.0, 1.0]
    expected += [-0.39159, 0.23374, -0.58277, -0.00663, -0.456, -0.58277, 0.39822, 0.22226, -0.58277]
    # The expected numbers have five decimals: 5e-6 of rounding.
    return CheckResult(values, 1e-5, expected, "slider rates for v_O = (1, 1, 1), v_O for unit slider rates, rows of A")


def _translation(w: StatePlant) -> Array:
    """Slider rates for v_O = (1, 1, 1), v_O for unit slider rates, rows 2 (G, -h): 15 numbers."""
    rotation, origin = w.pose("platform")
    rows = [2.0 * (origin + rotation @ vec(leg.lower) - w.pose(f"rod_{leg.index}")[1]) for leg in legs(SOURCE)]
    back, forth = _unit_rates(w, SLIDERS, HEAD_POSE, CENTRE), _unit_rates(w, CENTRE, (*SLIDERS, *ANGLES), SLIDERS)
    return np.concatenate([back, forth, np.ravel(rows)])


def _unit_rates(w: StatePlant, wanted: Names, given: Names, driving: Names) -> list[float]:
    """Rates of some joints or shafts for unit rates of those in `driving` together, the others of `given` held."""
    rates = response(w, given)[:, [given.index(n) for n in driving]].sum(axis=1)
    return [w.mechanism.row(n) @ rates for n in wanted]


def a2(p: Delta6Parameters) -> CheckResult:
    """The source's velocity example of the rotation."""
    geom, ones = SOURCE.geometry, np.ones(3)
    values = {
        "analytic": np.concatenate([closed.drives_from_angles(geom, ones), closed.angles_from_drives(geom, ones)])
    }
    for name, w in plants(build(SOURCE, "parts")).items():
        back, forth = _unit_rates(w, ROTARY, HEAD_POSE, ANGLES), _unit_rates(w, ANGLES, (*CENTRE, *ROTARY), ROTARY)
        values[name] = np.array(back + forth)
    # -0.5109 has four decimals: 5e-5 of rounding.
    note = "K (1, 1, 1) and K^-1 (1, 1, 1) through nine gear meshes; the source prints the latter as (0, -0.51, 1): alpha and beta swapped"
    return CheckResult(values, 5e-5, [1.4, 2.966, 1.0, -0.5109, 0.0, 1.0], note)


def _count_from_parts(bend_limit: float | None) -> list[int]:
    """Workspace counts from where the crosses of the `full` mechanism stand, node by node."""
    tree = TreeKinematics(build(SOURCE, "full"))
    nodes = np.arange(-100, 101) / 100.0
    x, y = np.meshgrid(nodes, nodes, indexing="ij")
    tops = []
    for i in (1, 2, 3):
        upper, lower = tree.pose(f"cross_{i}")[1], tree.pose(f"half_{i}")[1]
        span = lower - upper
        radicand = span @ span - (x + span[0]) ** 2 - (y + span[1]) ** 2
        height = np.sqrt(np.where(radicand >= 0.0, radicand, np.nan))
        if bend_limit is not None:
            height[np.arccos(height / np.sqrt(span @ span)) > bend_limit] = np.nan
        zero = tree.mechanism.zero(f"q{i}")
        tops.append(height + zero + span[2])
    stacked = np.array(tops)
    reached = np.isfinite(stacked).all(axis=0)
    drives = stacked[:, reached][:, :, None] + nodes
    inside = ((drives >= SOURCE.slider_min) & (drives <= SOURCE.slider_max)).all(axis=0)
    return [int(reached.sum()), int(inside.sum())]


def a6(p: Delta6Parameters) -> CheckResult:
    """The workspace on the source's grid, without and with a bend limit of the cardans."""
    values: dict[str, list[int]] = {"analytic": [], "numpy": []}
    for bend in (None, math.radians(45.0), math.radians(60.0)):
        counts = closed.workspace_counts(SOURCE.geometry, SOURCE.slider_min, SOURCE.slider_max, bend)
        values["analytic"] += [counts.xy_nodes, counts.voxels]
        values["numpy"] += _count_from_parts(bend)
    expected = [811, 18_724, 55, 2_003, 362, 10_885]
    return CheckResult(
        values, 0.0, expected, "nodes (x, y) and voxels: no bend limit, 45 deg, 60 deg; sliders 0.25 to 0.65 m"
    )


def a10(p: Delta6Parameters) -> CheckResult:
    """Sliding and friction in one mesh, against statics of the tooth contact."""
    velocity = closed.sliding_velocity(closed.contact_point(closed.tip_distance(20, 0.03)), 0.3, 0.3).velocity
    losses = [closed.approach_loss(19, 19, 0.16), closed.approach_loss(20, 20, 0.16), closed.recess_loss(20, 20, 0.16)]
    cases = ((19, "approach"), (20, "approach"), (20, "recess"))
    loss = {"analytic": losses, "statics": [tooth_loss(z, z, 0.16, phase) for z, phase in cases]}
    slide = {"analytic": velocity, "statics": tooth_sliding(20, 0.03)}
    unequal = closed.sliding_velocity([0.01, 0.02], 0.3, 0.2)
    rates = {"analytic": [unequal.contact_rate, unequal.driven_rate]}
    return check_quantities(
        # four printed decimals
        CheckedQuantity("sliding velocity of 20 teeth at the tip [m/s]", 5e-5, slide, [0.1296, -0.0472]),
        CheckedQuantity("loss factors at f = 0.16", 1e-5, loss, [1.09066, 1.08670, 1.07679]),
        CheckedQuantity("sliding, closed form against statics [m/s]", 1e-12, slide),
        # both pitch circles run at 0.3 m/s: the driven one, of 0.2 m, turns by -1.5 rad/s, and against the driver by -2.5
        CheckedQuantity("rates, radii 0.3 and 0.2 m [rad/s]", 1e-12, rates, [-2.5, 1.5]),
        CheckedQuantity("losses, closed form against statics", 1e-12, loss),
    )


CHECKS = (
    Check("A1", "velocity example of the translation (source's parameters)", a1,
          "thesis abstract, chapter 4, velocity example of the translation"),
    Check("A2", "velocity example of the rotation, through the gears (source's parameters)", a2,
          "thesis abstract, chapter 4, velocity example of the rotation"),
    Check("A6", "workspace counts on the grid of 0.01 m (source's parameters)", a6,
          "thesis abstract, chapter 3, workspace; counts of the grid"),
    Check("A10", "sliding velocity and friction loss of a gear mesh", a10,
          "thesis abstract, chapter 5, equations and table 1")
)  # fmt: skip
