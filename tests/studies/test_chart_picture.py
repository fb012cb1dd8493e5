"""The words of a chart: what the picture says follows from the points, and its labels do not cover each other."""

from __future__ import annotations

import io
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

from mechlab.studies.chart.advice import flat_defaults, flat_methods, headline, recommend, with_prefix
from mechlab.studies.chart.data import Chart, ChartPoint, Published
from mechlab.studies.chart.lines import line_label, spaced_apart
from mechlab.studies.chart.picture import picture


def line(name: str, errors: list[float], lost: int = 0) -> list[ChartPoint]:
    """Steps of 10, 5, 2.5 ... ms; the first `lost` diverge."""
    out = []
    for k, e in enumerate(errors):
        step, gone = 0.01 * 0.5**k, k < lost
        e = float("nan") if gone else e
        out.append(
            ChartPoint(
                name,
                step,
                "step",
                0.001 * 2**k,
                e,
                e,
                0.0,
                0.0,
                "diverged" if gone else "ok",
                default="defaults" in name,
            )
        )
    return out


def made(*lines: list[ChartPoint], target: float = 1e-3, published: tuple[Published, ...] = ()) -> Chart:
    points = tuple(p for x in lines for p in x)
    return Chart(
        "x", "X <mechanism> & more", "s", 1.0, "m", ("a_b", "y"), "own equations", 1e-9, points, {}, recommend(points, target, "m"),
        tuple(flat_defaults(points, target, "m")), published, {"mujoco": "4.0.0"},
    )  # fmt: skip


FLAT = line("MuJoCo RK4, defaults", [2.0, 2.0, 2.0, 2.0, 2.0], lost=1)
SOFT = line("MuJoCo Euler, defaults", [1.2, 1.9, 2.0, 2.0, 2.0])
FALLING = line("MuJoCo RK4, hard", [0.3, 2e-2, 1.2e-3, 8e-5, 5e-6])
FALLING_DEFAULT = line("MuJoCo discrete, defaults", [0.3, 2e-2, 1.2e-3, 8e-5, 5e-6])


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(2.0, "m", "2 m"), (2.5e-5, "m", "25 µm"), (0.0222, "s", "22 ms"), (9.999e-4, "m", "1 mm"), (0.455, "s", "460 ms"),
     (0.1, "rad", "100 mrad"), (3e-12, "m", "3 pm"), (1500.0, "m", "1.5 km"), (1e-30, "m", "1e-30 m")],
)  # fmt: skip
def test_quantities_carry_a_prefix(value: float, unit: str, text: str) -> None:
    assert with_prefix(value, unit) == text


def test_the_headline_is_what_the_points_say() -> None:
    assert headline(made(FLAT, SOFT, FALLING)) == "MuJoCo's defaults stay 2 m wrong, however small the step"
    some = headline(made(FLAT, FALLING_DEFAULT, FALLING))
    assert some == "MuJoCo's defaults with RK4 stay 2 m wrong, however small the step"
    assert set(flat_methods(made(FLAT, FALLING_DEFAULT))) == {"MuJoCo RK4, defaults"}
    assert headline(made(FALLING)) == "An error below 1 mm costs 8 ms of CPU with MuJoCo RK4, hard"
    assert headline(made(FALLING, target=1e-7)) == "No method comes within 100 nm here"
    renamed = [replace(p, method="MuJoCo RK4, as in the file") for p in FLAT]
    assert headline(made(renamed, FALLING)).startswith("The file's own settings stay 2 m wrong")


def test_a_label_says_where_a_method_diverges() -> None:
    assert line_label("m", FLAT) == "m  × 10 ms"
    assert line_label("m", FALLING) == "m"


@pytest.mark.parametrize("seed", range(5))
def test_labels_stand_apart_and_as_near_as_can_be(seed: int) -> None:
    """Against a general optimizer of the same least squares."""
    rng = np.random.default_rng(seed)
    wanted, gap = rng.beta(0.4, 0.6, 9), 0.07
    placed = np.array(spaced_apart(list(wanted), 0.0, 1.0, gap))
    order = np.argsort(wanted, kind="stable")
    steps = np.diff(placed[order])
    assert steps.min() > gap - 1e-12 and placed.min() >= 0.0 and placed.max() <= 1.0
    apart = LinearConstraint(np.diff(np.eye(9), axis=0), gap, np.inf)
    best = minimize(
        lambda y: np.sum((y - wanted[order]) ** 2), np.linspace(0.05, 0.95, 9), jac=lambda y: 2 * (y - wanted[order]),
        bounds=[(0.0, 1.0)] * 9, constraints=[apart], method="SLSQP", options={"ftol": 1e-14, "maxiter": 500},
    )  # fmt: skip
    assert np.sum((placed - wanted) ** 2) <= best.fun + 1e-7


def test_too_many_labels_stand_at_equal_distances() -> None:
    placed = spaced_apart([0.5] * 30, 0.0, 1.0, 0.07)
    assert np.allclose([b - a for a, b in pairwise(placed)], 1 / 29)
    assert spaced_apart([], 0.0, 1.0, 0.1) == [] and spaced_apart([3.0], 0.0, 1.0, 0.1) == [1.0]


@pytest.mark.parametrize("lines", [(FLAT, SOFT, FALLING), (FALLING,), (FLAT, FALLING_DEFAULT, FALLING)])
def test_the_picture_is_the_same_every_time_and_keeps_inside_its_edges(lines: tuple[list[ChartPoint], ...]) -> None:
    from PIL import Image

    chart = made(*lines, published=(Published("Someone's program", "a machine", 0.01),))
    assert picture(chart, "svg") == picture(chart, "svg")
    with Image.open(io.BytesIO(picture(chart, "png"))) as image:
        pixels = np.asarray(image.convert("L"))
    # a border of a few pixels is white: no word runs over the edge
    assert min(pixels[:4].min(), pixels[-4:].min(), pixels[:, :4].min(), pixels[:, -4:].min()) == 255
    assert np.mean(pixels < 250) > 0.02
