"""The comparisons against formulas from outside: straight lines, quick returns, walking legs; and the pages that are kept."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechlab as ml
from mechlab import catalog
from mechlab.errors import MechlabError
from mechlab.studies.compare import KINDS, Comparison, quick_return
from mechlab.studies.compare.measures import bars, longest, stretches, strip
from tests.same_files import difference

KEPT = Path(__file__).parents[2] / "assets" / "compare"


@pytest.fixture(scope="module")
def found() -> dict[str, Comparison]:
    return {kind: ml.compare(kind) for kind in KINDS}  # type: ignore[arg-type]


def thales(phi: np.ndarray) -> np.ndarray:
    """Place (n, 3) of the end of a linkage 1 : 2 : 2.5 : 5 in cranks: it stands at right angles to A-D over D, |P D|^2 = 25 - |A D|^2."""
    a = np.exp(1j * phi)
    away = 2.0 - a
    p = 2.0 + np.sqrt(25.0 - np.abs(away) ** 2) * 1j * away / np.abs(away)
    return np.column_stack([p.real, 0.0 * phi, p.imag])


def test_a_strip_is_the_narrowest() -> None:
    """A rectangle at an angle: its own sides; an arc over its chord: the sagitta r (1 - cos a); a line: nothing."""
    corners = np.array([[0, 0, 0], [5, 0, 0], [5, 2, 0], [0, 2, 0]], dtype=float)
    turn = np.array([[math.cos(0.7), -math.sin(0.7), 0], [math.sin(0.7), math.cos(0.7), 0], [0, 0, 1]])
    assert strip(corners @ turn.T) == pytest.approx((2.0, 5.0))
    t = np.linspace(-0.3, 0.3, 201)
    arc = np.column_stack([np.sin(t), 0.0 * t, np.cos(t)])
    assert strip(arc) == pytest.approx((1.0 - math.cos(0.3), 2.0 * math.sin(0.3)))
    assert strip(np.outer(t, [1.0, 2.0, 3.0]))[0] == 0.0
    best = longest(*stretches(arc[::5]), 0.02)  # sagitta / chord = tan(a / 2) / 2 = .02 for a = .08
    assert best is not None and t[::5][best[1]] - t[::5][best[0]] == pytest.approx(2 * 2 * math.atan(0.04), abs=0.6 / 40)


@pytest.mark.parametrize("name", ["peaucellier", "hart", "scott_russell", "sarrus", "cardan_circles", "geometric_pen"])
def test_exact_lines_are_exact(found: dict[str, Comparison], name: str) -> None:
    """Their whole path is the stroke: by the outside numbers of the entries."""
    p: Any = catalog.entry(name).parameters()
    row = found["straight-line"][name]
    assert row["deviation"] in (0.0, None)
    whole = {
        "peaucellier": lambda: (p.arm**2 - p.side**2) / p.crank * math.tan(p.swing / 2) / p.arm,  # y = x tan of half the crank angle
        "scott_russell": lambda: 4 * p.crank * math.sin(p.swing) / (2 * p.crank),
    }
    if name in whole:
        assert row["stroke"] == pytest.approx(whole[name](), rel=1e-9)


def test_straight_strokes_against_curves_from_outside(found: dict[str, Comparison]) -> None:
    """Hoeken by Thales' theorem at the same places; Watt's and Chebyshev's bars; Evans by projections."""
    straight = found["straight-line"]
    width, length = stretches(thales(np.linspace(0.0, 2.0 * math.pi, 97)))
    enough = np.where(length >= 2.5, width / length, np.inf)  # half of the longest bar, 5 cranks
    assert straight["hoeken"]["deviation"] == pytest.approx(np.nanmin(enough), rel=1e-6)
    i_j = longest(width, length, 1e-3)
    assert i_j is not None and straight["hoeken"]["stroke"] == pytest.approx(length[i_j] / 5.0, rel=1e-9)

    p: Any = catalog.entry("evans").parameters()
    rocker, t = p.rear**2 / p.head, np.linspace(-p.swing, p.swing, 97)
    sine = rocker / p.rear * np.sin(t)
    path = np.column_stack([p.head * np.sqrt(1.0 - sine**2) - rocker * np.cos(t), 0.0 * t, (rocker + p.head * rocker / p.rear) * np.sin(t)])
    width, length = stretches(path)
    enough = np.where(length >= 0.5 * (p.rear + p.head), width / length, np.inf)
    assert straight["evans"]["deviation"] == pytest.approx(np.nanmin(enough), rel=1e-6)
    for name, ratio in (("chebyshev", 2.5), ("hoeken", 5.0), ("peaucellier", 2.5), ("roberts", 0.2 / 0.12), ("watt", None)):
        q: Any = catalog.entry(name).parameters()
        ratio = 2 * math.hypot(q.lever, q.coupler / 2) / q.coupler if ratio is None else ratio
        assert straight[name]["bar_ratio"] == pytest.approx(ratio, rel=1e-9)


def test_chebyshev_deviates_as_his_curve_does(found: dict[str, Comparison]) -> None:
    """Cranks 5, ground 4, coupler 2 by two circles. At half a bar the stroke is 2.5 units of the ground of 4."""
    theta = np.linspace(math.atan2(3, 4) + 0.02, math.pi / 2, 97)
    a = 5.0 * np.exp(1j * theta)
    d = 4.0 - a
    along = (4.0 - 25.0 + np.abs(d) ** 2) / (2.0 * np.abs(d))
    p = []
    for side in (-1.0, 1.0):
        b = a + (along + side * 1j * np.sqrt(4.0 - along**2)) * d / np.abs(d)
        p.append(0.5 * (a + b))
    path = min(p, key=lambda z: abs(z[-1] - 4j))  # the left end of the straight line is (0, 4)
    width, length = stretches(np.column_stack([path.real, 0.0 * theta, path.imag]))
    enough = np.where(length >= 2.5, width / length, np.inf)
    assert found["straight-line"]["chebyshev"]["deviation"] == pytest.approx(np.nanmin(enough), rel=1e-6)


@pytest.mark.parametrize("ratio", [1.4, 2.0, 2.6])
@pytest.mark.parametrize("name", ["whitworth", "quick_return"])
def test_time_ratios_are_those_of_the_formula(name: str, ratio: float) -> None:
    """(pi + 2 asin k) / (pi - 2 asin k), k = eccentricity / crank (Whitworth) and crank / distance (slotted lever): the crank stands at
    right angles to the lever, or the lever along the bed, at the ends. The spline through 360 places finds the ends to 1e-7."""
    e = catalog.entry(name)
    changed = quick_return.set_to(e, ratio)
    p: Any = e.parameters()
    k = changed["eccentricity"] / p.crank if name == "whitworth" else changed["crank"] / p.distance
    formula = (math.pi + 2 * math.asin(k)) / (math.pi - 2 * math.asin(k))
    ram, _ = quick_return.ram_of(e, changed)
    assert formula == pytest.approx(ratio, rel=1e-12)
    assert ram.numbers["time_ratio"] == pytest.approx(formula, rel=1e-5)


def test_speed_of_whitworths_ram_in_units_of_the_stroke(found: dict[str, Comparison]) -> None:
    """ds/du by the closed form: A = (c cos, e + c sin), E opposite to A at the arm, ram x = E_x + sqrt(rod^2 - E_z^2), stroke 2 arm."""
    p: Any = catalog.entry("whitworth").parameters()
    phi = np.linspace(0.0, 2.0 * math.pi, 200_001)
    a = p.crank * np.exp(1j * phi) + 0.5j * p.crank  # eccentricity half of the crank: time ratio 2
    end = -p.arm * a / np.abs(a)
    x = end.real + np.sqrt(p.rod**2 - end.imag**2)
    rate = np.gradient(x, phi) * 2 * math.pi / (2 * p.arm)
    slow = a.imag > 0.0
    row = found["quick-return"]["whitworth"]
    assert row["peak_speed"] == pytest.approx(np.abs(rate[slow]).max(), rel=1e-4)  # the largest of 360 places
    assert row["peak_return_speed"] == pytest.approx(np.abs(rate[~slow]).max(), rel=1e-3)
    assert row["peak_torque"] == pytest.approx(row["peak_speed"] / (2 * math.pi))


def test_chebyshevs_foot_walks_as_thales_says(found: dict[str, Comparison]) -> None:
    """Lift and step of the plantigrade machine from the closed form of its path, at the same places."""
    path = thales(np.linspace(0.5 * math.pi, 2.5 * math.pi, 361))
    x, z = path[:, 0], path[:, 2]
    low = z - z.min() <= 0.02 * np.ptp(x)
    row = found["walking"]["plantigrade"]
    assert z.min() == pytest.approx(4.0, abs=1e-12)  # the straight side is the lower one
    assert row["lift"] == pytest.approx(np.ptp(z) / np.ptp(x[low]), rel=1e-9)
    assert row["straightness"] == pytest.approx(np.ptp(z[low]) / np.ptp(x[low]), rel=1e-6)
    assert row["duty"] == pytest.approx(low[:-1].mean(), abs=1e-9)
    assert row["peak_torque"] == pytest.approx(np.abs(np.gradient(z, 2 * math.pi / 360))[low].max() / np.ptp(x[low]), rel=0.02)


def test_bars_of_spatial_and_geared_mechanisms_have_no_ratio() -> None:
    assert all(bars(ml.load(n).mechanism(), {}) == [] for n in ("sarrus", "cardan_circles"))


def test_files_of_a_comparison(found: dict[str, Comparison], tmp_path: Path) -> None:
    (tmp_path / "jansen").mkdir()
    (tmp_path / "jansen" / "explore.html").write_text("")
    page = found["walking"].save(tmp_path / "w.html").read_text("utf-8")
    assert 'href="jansen/explore.html"' in page and 'href="klann' not in page and "default-src 'none'" in page
    rows = found["walking"].save(tmp_path / "w.csv").read_text("utf-8").splitlines()
    assert len(rows) == 1 + len(found["walking"].rows)
    with pytest.raises(MechlabError, match="none of the endings .html, .csv, .json"):
        found["walking"].save(tmp_path / "w.txt")
    with pytest.raises(MechlabError, match="'straight' does not exist. Did you mean 'straight-line'"):
        ml.compare("straight")  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", KINDS)
def test_the_kept_pages_are_current(kind: str, found: dict[str, Comparison], tmp_path: Path) -> None:
    made = found[kind].save(tmp_path / f"{kind}.html")
    assert not difference(KEPT / made.name, made), f"run: mechlab compare {kind} -o assets/compare/{kind}.html"
