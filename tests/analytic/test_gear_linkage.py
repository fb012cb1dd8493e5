"""The three-gear four-bar against independent truth: rolling, differences, a table found by other root finders."""

import math
from dataclasses import replace

import numpy as np
import pytest

from mechlab.analytic import gear_linkage as closed
from mechlab.errors import MechlabError, NoSolution

# Our reference table (scipy 1.17.1, November 2026): coupler, rocker, idler in units of the frame; momentary crank and
# where; crank for 2 deg of reverse motion with its dwell and one-sided dwell [deg]; crank for 60 deg of dwell with its
# reverse angle [deg]; cranks for 90 deg one-sided and for 30 deg back; transmission angle at the momentary crank [deg].
TABLE = {
    "L1": (
        1.0, 1.0, 0.5, 0.4428909829, 5.01970361, 0.4728822419,
        46.53457, 66.93223, 0.4941925986, 4.40846, 0.5015867576, 0.6364751922, 32.35,
    ),
    "L2": (
        1.0, 0.8, 0.4, 0.4979399792, 4.78275664, 0.5217977387,
        42.35421, 61.65695, 0.5468949887, 5.84458, 0.5526726242, 0.6434069164, 29.84,
    ),
    "L3": (
        0.9, 0.9, 0.3, 0.5163576846, 4.98967275, 0.5485218860,
        51.69196, 73.50247, 0.5599971562, 3.15517, 0.5669706132, 0.7072419918, 31.17,
    ),
    "L4": (
        0.8, 1.0, 0.4, 0.3493639744, 5.11185871, 0.3805848292,
        53.82571, 77.47736, 0.3886745714, 2.80552, 0.3931265683, 0.5531959083, 40.50,
    ),
}  # fmt: skip


def random_linkages(count: int, seed: int = 7) -> list[closed.GearLinkage]:
    rng = np.random.default_rng(seed)
    out: list[closed.GearLinkage] = []
    while len(out) < count:
        frame, coupler, rocker = rng.uniform(0.3, 2.0, 3)
        top = closed.longest_crank(coupler, rocker, frame)
        if top < 0.05:
            continue
        mode = 1 if len(out) % 2 else -1
        idler = rng.uniform(0.1, 0.9) * min(coupler, rocker)
        out.append(closed.GearLinkage(rng.uniform(0.05, 0.97) * top, coupler, rocker, idler, frame, mode))
    return out


def test_the_loop_closes_in_the_asked_mode() -> None:
    phi = np.linspace(-7.0, 7.0, 57)
    for g in random_linkages(60):
        psi, chi, mu = closed.angles(g, phi)
        b = g.crank * np.exp(1j * phi)
        c = b + g.coupler * np.exp(1j * psi)
        assert np.max(np.abs(c - g.frame - g.rocker * np.exp(1j * chi))) < 1e-13
        side = ((g.frame - b).conjugate() * (c - b)).imag
        assert np.all(side * g.mode > 0.0)
        cosine = ((b - c).conjugate() * (g.frame - c)).real / (g.coupler * g.rocker)
        assert np.max(np.abs(np.cos(mu) - cosine)) < 1e-12


def test_rates_are_those_of_rolling_in_both_modes() -> None:
    phi = np.linspace(0.0, 2.0 * math.pi, 61)
    for g in random_linkages(300):
        x = closed.motion(g, phi)
        idler, output = closed.rolling_rates(g, phi)
        scale = 1.0 + np.max(np.abs(output))
        assert np.max(np.abs(x.output_rate - output)) < 1e-8 * scale
        assert np.max(np.abs(x.idler_rate - idler)) < 1e-8 * scale


def test_rates_and_accelerations_are_derivatives() -> None:
    phi, h = np.linspace(0.1, 6.1, 23), 1e-5
    for g in random_linkages(40):
        x = closed.motion(g, phi)
        ahead, behind = closed.motion(g, phi + h), closed.motion(g, phi - h)
        for part in ("coupler", "rocker", "idler", "output"):
            for value, derivative in (("angle", "rate"), ("rate", "accel")):
                found = (getattr(ahead, f"{part}_{value}") - getattr(behind, f"{part}_{value}")) / (2.0 * h)
                truth = getattr(x, f"{part}_{derivative}")
                # Truncation h^2 / 6 of the third derivative, which near a change point is large against the first.
                assert np.max(np.abs(found - truth)) < 1e-5 * (1.0 + np.max(np.abs(x.output_accel)))


def test_a_moving_crank_takes_its_rate_and_acceleration_along() -> None:
    g, w, e, phi = random_linkages(1)[0], -1.7, 0.9, 2.2
    h = 1e-5

    def at(t: float) -> float:
        return float(closed.motion(g, phi + w * t + 0.5 * e * t * t).output_angle)

    x = closed.motion(g, phi, w, e)
    assert math.isclose(x.output_rate, (at(h) - at(-h)) / (2 * h), abs_tol=1e-7)
    # Second difference: rounding 4e-16 / 1e-10.
    assert math.isclose(x.output_accel, (at(h) - 2 * at(0.0) + at(-h)) / h**2, abs_tol=1e-4)


def test_a_turn_of_the_crank_turns_the_output_by_the_ratio() -> None:
    for g in random_linkages(50):
        turn = closed.motion(g, np.array([0.0, 2.0 * math.pi, 14.0 * math.pi])).output_angle
        assert np.allclose(turn, 2.0 * math.pi * g.ratio * np.array([0, 1, 7]), atol=1e-12 * (1 + 40 * g.ratio), rtol=0)


def test_the_modes_mirror_each_other() -> None:
    phi = np.linspace(0.0, 6.0, 31)
    for g in random_linkages(20):
        assert np.allclose(closed.rate(replace(g, mode=-g.mode), phi), closed.rate(g, -phi), atol=1e-10, rtol=1e-10)


@pytest.mark.parametrize("name", TABLE)
def test_table(name: str) -> None:
    b, c, r, star, at, c2, dwell2, one2, c60, back60, c90, c30, mu = TABLE[name]
    found = closed.momentary_crank(b, c, r)
    assert math.isclose(found, star, abs_tol=1e-8)
    g = closed.GearLinkage(found, b, c, r)
    # The place of a minimum is known to the root of the rounding of its value: the table has it to 5e-8.
    assert math.isclose(closed.slowest(g)[0], at, abs_tol=5e-8)
    assert math.isclose(math.degrees(closed.regime(g).least_transmission_angle), mu, abs_tol=5e-3)
    for target, degrees, crank in (
        ("reverse_angle", 2, c2), ("dwell_angle", 60, c60), ("dwell_angle_one_sided", 90, c90), ("reverse_angle", 30, c30),
    ):  # fmt: skip
        answer = closed.crank_for(target, math.radians(degrees), b, c, r)
        assert answer.crank is not None and math.isclose(answer.crank, crank, abs_tol=1e-8)
    two = closed.regime(replace(g, crank=c2))
    assert math.isclose(math.degrees(two.dwell_angle), dwell2, abs_tol=1e-5)
    assert math.isclose(math.degrees(two.dwell_angle_one_sided), one2, abs_tol=1e-5)
    assert math.isclose(math.degrees(closed.regime(replace(g, crank=c60)).reverse_angle), back60, abs_tol=1e-5)


@pytest.mark.parametrize("name", TABLE)
@pytest.mark.parametrize("mode", (1, -1))
def test_synthesis_does_not_depend_on_the_mode(name: str, mode: int) -> None:
    b, c, r, star = TABLE[name][:4]
    assert math.isclose(closed.momentary_crank(b, c, r, mode=mode), star, abs_tol=1e-8)
    assert math.isclose(closed.momentary_crank(3 * b, 3 * c, 3 * r, frame=3.0, mode=mode), 3 * star, abs_tol=3e-8)


def test_near_the_momentary_dwell_the_reverse_angle_is_the_cube_of_the_dwell() -> None:
    ratios = []
    for factor in (1.001, 1.003, 1.01, 1.03):
        b, c, r, star = TABLE["L1"][:4]
        report = closed.regime(closed.GearLinkage(factor * star, b, c, r))
        ratios.append(report.reverse_angle / report.dwell_angle**3)
    assert np.allclose(ratios, (0.06254, 0.06262, 0.06290, 0.06368), atol=6e-6)
    g = closed.GearLinkage(star, b, c, r)
    at, h = closed.slowest(g)[0], 1e-3
    curvature = float(np.dot(closed.rate(g, at + h * np.array([-1, 0, 1])), [1, -2, 1])) / h**2
    assert math.isclose(curvature / 12.0, 0.0625, abs_tol=1e-4)
    report = closed.regime(replace(g, crank=1.001 * star))
    assert math.isclose(report.dwell_angle_one_sided / report.dwell_angle, 1.494, abs_tol=1e-3)


@pytest.mark.parametrize("name", TABLE)
def test_targets_grow_with_the_crank(name: str) -> None:
    b, c, r, star = TABLE[name][:4]
    cranks = np.linspace(1.0001 * star, 0.999999 * closed.longest_crank(b, c), 40)
    reports = [closed.regime(closed.GearLinkage(float(x), b, c, r)) for x in cranks]
    for target in closed.TARGETS:
        assert np.all(np.diff([getattr(x, target) for x in reports]) > 0.0)


def test_what_is_out_of_reach_has_no_crank() -> None:
    answer = closed.crank_for("reverse_angle", math.radians(175.0), 1.0, 0.8, 0.4)
    # 119.4 deg at 0.998 of the longest crank, more next to the change point.
    assert answer.crank is None and 119.4 < math.degrees(answer.reachable[1]) < 175.0
    almost = closed.crank_for("reverse_angle", answer.reachable[1] - 1e-3, 1.0, 0.8, 0.4)
    assert almost.crank is not None and almost.crank < closed.longest_crank(1.0, 0.8)


def test_play_holds_the_output() -> None:
    g = closed.GearLinkage(TABLE["L1"][5], 1.0, 1.0, 0.5)
    report = closed.regime(g)
    phi = report.stop_angle + np.linspace(-1.0, 3.0, 40001)
    x = closed.motion(g, phi).output_angle
    held = closed.with_play(x, 1.0001 * report.reverse_angle)
    still = phi[1:][np.diff(held) == 0.0]
    assert math.isclose(still[-1] - phi[0] - 1.0, report.dwell_angle_one_sided, abs_tol=3e-4)
    assert np.all(np.diff(held) >= 0.0)
    tight = closed.with_play(x, 0.25 * report.reverse_angle)
    assert (
        math.isclose(np.max(-np.diff(tight)) > 0.0, True) and np.max(tight - x) <= 0.25 * report.reverse_angle + 1e-15
    )
    assert np.array_equal(closed.with_play(x, 0.0), x)


def test_reduced_inertia_has_the_right_slope() -> None:
    masses, phi, h = closed.LinkageMasses(1.3, 2.1), np.linspace(0.0, 6.0, 31), 1e-6
    for g in random_linkages(10):
        _, slope = closed.reduced_inertia(g, masses, phi)
        ahead, behind = (closed.reduced_inertia(g, masses, phi + s * h)[0] for s in (1, -1))
        assert np.allclose((ahead - behind) / (2 * h), slope, atol=1e-6 * np.max(1.0 + np.abs(slope)))


def test_refusals() -> None:
    with pytest.raises(NoSolution, match="does not turn fully.*0.8"):
        closed.GearLinkage(0.81, 0.9, 0.9, 0.3)
    with pytest.raises(NoSolution, match="no crank turns fully"):
        closed.GearLinkage(0.1, 0.3, 0.4, 0.2)
    with pytest.raises(MechlabError, match="idler_radius"):
        closed.GearLinkage(0.3, 0.9, 0.9, 0.9)
    with pytest.raises(MechlabError, match="mode"):
        closed.GearLinkage(0.3, 0.9, 0.9, 0.3, mode=0)
    with pytest.raises(MechlabError, match="target.*dwell_angle"):
        closed.crank_for("stop", 0.1, 1.0, 1.0, 0.5)
    with pytest.raises(MechlabError, match="at least zero"):
        closed.crank_for("reverse_angle", -0.1, 1.0, 1.0, 0.5)
    with pytest.raises(MechlabError, match="crank_angle"):
        closed.motion(closed.GearLinkage(0.3, 0.9, 0.9, 0.3), math.nan)


def test_at_the_change_point_there_are_no_rates() -> None:
    g = closed.GearLinkage(0.8, 0.9, 0.9, 0.3)
    x = closed.motion(g, [1.0, math.pi])
    assert g.at_change_point and x.regular.tolist() == [True, False]
    assert np.isfinite(x.output_rate[0]) and np.isnan(x.output_rate[1])
