"""Regions: the laws of the algebra, signs, margins against geometry, and which clause binds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechlab.analytic import delta6
from mechlab.analytic.delta6.workspace import point_segment_distance, segment_distance
from mechlab.analytic.regions import EXACT, SMOOTH, Both, Clause, Either, all_of, any_of, indicator, r_functions
from mechlab.errors import MechlabError

FORMS = (EXACT, SMOOTH, r_functions(0.5), r_functions(0.99))
VALUE = st.floats(-1e150, 1e150, allow_nan=False)
LAW = settings(max_examples=150, deadline=None)


@pytest.mark.parametrize("form", FORMS, ids=lambda f: f.name)
@LAW
@given(x=VALUE, y=VALUE)
def test_laws_of_one_form(form, x, y):
    meet, join = form.meet, form.join
    assert meet(x, y) == meet(y, x) and join(x, y) == join(y, x)
    assert join(x, y) == -meet(-x, -y)  # De Morgan, exact
    assert indicator(meet(x, y)) == (x >= 0 and y >= 0)
    assert indicator(join(x, y)) == (x >= 0 or y >= 0)


@LAW
@given(x=VALUE, y=VALUE, z=VALUE)
def test_the_lattice_is_exact_and_the_smooth_form_has_its_signs(x, y, z):
    def laws(form):
        a, o = form.meet, form.join
        yield a(a(x, y), z), a(x, a(y, z))  # associative
        yield a(x, o(y, z)), o(a(x, y), a(x, z))  # distributive
        yield o(x, a(x, y)), x  # absorption
        yield a(x, x), x  # idempotent

    assert all(left == right for left, right in laws(EXACT))
    assert all(indicator(left) == indicator(right) for left, right in laws(SMOOTH))


@pytest.mark.parametrize("form", FORMS[1:], ids=lambda f: f.name)
def test_tiny_arguments_keep_their_sign(form):
    # x + y - hypot(x, y) itself gives 0, "inside", from -1e-17 on
    for tiny in (1e-17, 1e-20, 1e-300, 5e-324):
        assert form.meet(-tiny, 1.0) < 0.0 <= form.meet(tiny, 1.0)
        assert form.join(tiny, -1.0) > 0.0 > form.join(-tiny, -1.0)
    assert SMOOTH.meet(-1e-20, 1.0) == pytest.approx(-1e-20, rel=1e-12)


def test_r_functions_in_value():
    rng = np.random.default_rng(1)
    x, y = rng.standard_normal((2, 1000))
    for alpha in (0.0, 0.5):
        s = np.sqrt(x**2 + y**2 - 2 * alpha * x * y)
        form = r_functions(alpha)
        np.testing.assert_allclose(form.meet(x, y), (x + y - s) / (1 + alpha), atol=1e-14)
        np.testing.assert_allclose(form.join(x, y), (x + y + s) / (1 + alpha), atol=1e-14)
    np.testing.assert_allclose(
        r_functions(1 - 1e-12).meet(x, y), np.minimum(x, y), atol=2e-5
    )  # s = |x - y| + O(sqrt(1 - alpha))
    value = 1.0
    for _ in range(9):
        value = float(SMOOTH.meet(value, 1.0))
    assert value == pytest.approx(0.1587, abs=1e-4)  # ten unit margins, nine meets: no margin any more
    with pytest.raises(MechlabError, match="alpha"):
        r_functions(1.0)


def test_the_smooth_form_has_a_gradient_where_the_lattice_has_none():
    for x in (0.7, 2.0):
        h = 1e-6
        slopes = [(SMOOTH.meet(x + s * h, x) - SMOOTH.meet(x, x)) / (s * h) for s in (1, -1)]
        assert slopes[0] == pytest.approx(slopes[1], abs=1e-5)  # differences of first order
        assert slopes[0] == pytest.approx(1 - 1 / math.sqrt(2), abs=1e-5)


def disc(name, cx, cy, r, lever=1.0):
    return Clause(name, lambda p: (r - np.hypot(p["x"] - cx, p["y"] - cy)) / lever, ("x", "y"), lever=lever)


def test_a_lens_its_distances_and_its_clauses():
    lens = disc("left", -0.5, 0.0, 1.0) & disc("right", 0.5, 0.0, 1.0, lever=3.0)
    rng = np.random.default_rng(2)
    p = dict(zip("xy", rng.uniform(-2, 2, (2, 4000)), strict=True))
    found = lens.decide(p)
    border = np.linspace(-np.pi / 3, np.pi / 3, 20001)
    arcs = np.concatenate(
        [
            np.column_stack([np.cos(border) - 0.5, np.sin(border)]),
            np.column_stack([0.5 - np.cos(border), np.sin(border)]),
        ]
    )
    xy = np.column_stack([p["x"], p["y"]])
    inside = np.flatnonzero(found.inside)[:100]
    true = np.array([np.min(np.hypot(*(arcs - q).T)) for q in xy[inside]])
    np.testing.assert_allclose(found.margin[inside], true, atol=1e-4)  # arcs are sampled every 1e-4
    outside = np.flatnonzero(~found.inside)[:100]
    far = np.array([np.min(np.hypot(*(arcs - q).T)) for q in xy[outside]])
    assert np.all(-found.margin[outside] <= far + 1e-12)  # only a lower bound outside
    assert np.array_equal(found.inside, lens.margin(p, SMOOTH) >= 0.0)
    assert np.array_equal(found.binding() == "left", p["x"] > 0)  # the farther circle decides


def test_complement_and_union_of_regions():
    a, b = disc("a", 0.0, 0.0, 1.0), disc("b", 1.0, 0.0, 1.0)
    rng = np.random.default_rng(3)
    p = dict(zip("xy", rng.uniform(-2, 3, (2, 5000)), strict=True))
    left, right = ~(a & b), ~a | ~b
    assert np.array_equal(left.margin(p), right.margin(p)) and np.array_equal(
        left.margin(p, SMOOTH), right.margin(p, SMOOTH)
    )
    direct = (np.hypot(p["x"], p["y"]) <= 1) | (np.hypot(p["x"] - 1, p["y"]) <= 1)
    assert np.array_equal((a | b).decide(p).inside, direct)
    assert isinstance(all_of([a, b]), Both) and isinstance(any_of([a, b]), Either)
    assert [c.name for c in ((a & b) | ~a).clauses] == ["a", "b"]
    on = {"x": np.array([1.0]), "y": np.array([0.0])}
    assert a.decide(on).inside.all() and (~a).decide(on).inside.all()  # the border belongs to both


def test_bad_regions_are_named():
    with pytest.raises(MechlabError, match="lever"):
        disc("a", 0, 0, 1, lever=-1.0)
    with pytest.raises(MechlabError, match="unique.*twice"):
        (disc("twice", 0, 0, 1) & disc("twice", 1, 0, 1)).decide({"x": np.zeros(1), "y": np.zeros(1)})
    with pytest.raises(MechlabError, match="'far'.*'y'"):
        disc("far", 0, 0, 1).decide({"x": np.zeros(1)})
    with pytest.raises(MechlabError, match="at least one"):
        all_of([])


def test_a_two_link_arm():
    """Joint limits and a keep-out disc; 100 000 joint poses against the direct test of the source of the numbers."""
    l1, l2 = 0.3, 0.25
    arm = all_of([
        Clause("q1_min", lambda p: p["q1"] + 1.2, ("q1",), lever=l1 + l2),
        Clause("q1_max", lambda p: 1.8 - p["q1"], ("q1",), lever=l1 + l2),
        Clause("q2_min", lambda p: p["q2"] - 0.3, ("q2",), lever=l2),
        Clause("q2_max", lambda p: 2.2 - p["q2"], ("q2",), lever=l2),
        ~Clause("disc", lambda p: 0.08 - np.hypot(*(tip(p) - np.array([[0.3], [0.2]]))), ("q1", "q2")),
    ])  # fmt: skip

    def tip(p):
        a, b = p["q1"], p["q1"] + p["q2"]
        return np.array([l1 * np.cos(a) + l2 * np.cos(b), l1 * np.sin(a) + l2 * np.sin(b)])

    rng = np.random.default_rng(4)
    p = {"q1": rng.uniform(-2, 2.5, 100_000), "q2": rng.uniform(0, 2.5, 100_000)}
    x, y = tip(p)
    direct = (p["q1"] >= -1.2) & (p["q1"] <= 1.8) & (p["q2"] >= 0.3) & (p["q2"] <= 2.2)
    direct &= np.hypot(x - 0.3, y - 0.2) >= 0.08
    for form in (EXACT, SMOOTH):
        assert np.array_equal(arm.margin(p, form) >= 0.0, direct)


def test_segments_against_samples():
    rng = np.random.default_rng(5)
    a, b, c, d = rng.standard_normal((4, 60, 3))
    c[:10] = a[:10] + 0.3  # parallel ones too
    d[:10] = b[:10] + 0.3
    s = np.linspace(0, 1, 801)
    along = a[:, None] + s[:, None] * (b - a)[:, None]
    other = np.array([point_segment_distance(along[k], c[k], d[k]).min() for k in range(60)])
    found = segment_distance(a, b, c, d)
    assert np.all(found <= other + 1e-12)
    np.testing.assert_allclose(found, other, atol=3e-3)  # a sample is at most 1/800 of a segment away


def test_the_delta_region_is_the_sources_test():
    rng = np.random.default_rng(6)
    p = np.column_stack([rng.uniform(-0.25, 0.25, (4_000, 2)), rng.uniform(-0.3, 0.4, 4_000)])
    points = dict(zip("xyz", p.T, strict=True))
    for k in range(4):
        geom = delta6.Delta6(rod_length=0.33 + 0.03 * k, tangential_offset=0.003 * k, slider_height=0.02 * k)
        limits = delta6.WorkspaceLimits(0.3, 0.5 + 0.05 * k, math.radians(50 + 8 * k), 0.1 * k, 0.0909)
        found = delta6.workspace_region(geom, limits).decide(points)
        said = delta6.inverse_position(geom, p)
        margins = delta6.pose_margins(geom, p)
        direct = said.reachable & np.all((said.drives >= limits.slider_min) & (said.drives <= limits.slider_max), -1)
        direct &= np.nan_to_num(margins.largest_bend, nan=9.0) <= limits.bend_limit
        direct &= margins.inverse_condition >= limits.least_condition
        direct &= delta6.clearance(geom, p) >= limits.least_clearance
        assert np.array_equal(found.inside, direct)
        tight = found.inside & (found.binding() == "bend")
        # along the worst direction the bend limit is hit after exactly the margin
        if tight.any():
            q = p[np.flatnonzero(tight)[0]]
            g = delta6.leg_vectors(geom, q)
            worst = np.argmax(np.hypot(*g.T))
            step = found.margin[np.flatnonzero(tight)[0]] * g[worst] / np.linalg.norm(g[worst])
            at = delta6.pose_margins(geom, q + np.append(step, 0.0))
            assert at.largest_bend == pytest.approx(limits.bend_limit, abs=1e-12)


def test_clearance_of_a_hand_made_pose():
    # At home the nearest centre lines are the lower ends of the plain rod of one leg and the cardan rod of the next.
    geom = delta6.Delta6()
    lower = geom.platform_anchors
    beside = lower + 0.04 * np.column_stack([geom.tangential_directions, np.zeros(3)])
    pairs = [(i, j) for i in range(3) for j in range(3) if i != j]
    ends = [np.linalg.norm(u - v) for i, j in pairs for u in (lower[i], beside[i]) for v in (lower[j], beside[j])]
    found = float(delta6.clearance(geom, np.zeros(3)))
    assert found <= min(ends) and found == pytest.approx(0.0907914, abs=1e-6)
    rods = []
    for i in range(3):
        top = np.append(geom.guide_positions[i], geom.home_height)
        foot = np.append(lower[i, :2], 0.0)
        rods += [
            (i, foot + s * d, top + s * d) for s in (0.0, 0.04) for d in [np.append(geom.tangential_directions[i], 0)]
        ]
    s = np.linspace(0, 1, 2001)
    least = min(
        float(point_segment_distance(a + s[:, None] * (b - a), c, d).min())
        for i, a, b in rods for j, c, d in rods if i != j
    )  # fmt: skip
    guides = min(
        float(point_segment_distance(geom.guide_positions[i], a[:2], b[:2]))
        for i in range(3)
        for j, a, b in rods
        if i != j
    )
    assert found == pytest.approx(min(least, guides), abs=1e-6)
