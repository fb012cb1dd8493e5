"""All modes of linkages of rigid links: against the polynomial of classes III and IV, the table of the class IV linkage, constructed
positions of a class VI group, differences for the rates, and statements that are refused."""

import numpy as np
import pytest

from mechlab.analytic import assur
from mechlab.analytic.assur.bilinear import Bilinear, all_solutions, path_count
from mechlab.analytic.assur.link_modes import branches, modes_by_trial, modes_of, positions
from mechlab.analytic.assur.links import Links
from mechlab.errors import MechlabError

CLASS_4 = Links(
    {
        "1": {"O": 0j, "A": 0.279 + 0j}, "2": {"A": 0j, "C": 0.985 + 0j, "D": 0.251 * np.exp(1j * np.radians(37.3))},
        "3": {"C": 0j, "B": 0.3 + 0j}, "4": {"D": 0j, "E": 0.554 + 0j},
        "5": {"F": 0j, "B": 2.06 + 0j, "E": 1.3 * np.exp(1j * np.radians(28.1))},
    },
    {"O": 0j, "F": -1.08j}, ("1",),
)  # fmt: skip
TURN = np.radians(-180.0 + 5.0 * np.arange(72))[:, None]


def platform(rng: np.random.Generator) -> tuple[Links, assur.TwoLoops]:
    """A random platform on three legs as links, and as the group of class III."""
    pins = [assur.fixed(*(1.5 * rng.standard_normal(2))) for _ in range(3)]
    legs = tuple(rng.uniform(1.0, 2.5, 3))
    plate = tuple(complex(*rng.standard_normal(2)) for _ in range(2))
    links = {f"leg{k}": {f"G{k}": 0j, f"P{k}": complex(legs[k])} for k in range(3)}
    links["plate"] = {"P0": 0j, "P1": plate[0], "P2": plate[1]}
    return Links(links, {f"G{k}": complex(p.p) for k, p in enumerate(pins)}, ()), assur.class_three(tuple(pins), legs, plate)


def test_class_three_against_the_polynomial() -> None:
    """Number of modes and turns of the first leg and the plate for random platforms of 0 to 6 modes, ten of each number."""
    rng, counts = np.random.default_rng(3), []
    while len(counts) < 40:
        linkage, group = platform(rng)
        known = assur.all_modes(group)
        if counts.count(int(known.count)) == 10:
            continue
        found = modes_of(linkage, np.zeros((1, 0)))
        assert found.bound == 6 and found.lost[0] == 0
        assert found.count[0] == known.count
        counts.append(int(known.count))
        for t, u in zip(known.theta_t[: known.count], known.theta_u[: known.count], strict=True):
            away = np.abs(np.exp(1j * found.turns[0, : known.count][:, [0, 3]]) - np.exp(1j * np.array([t, u]))).max(axis=1)
            assert away.min() < 1e-8
    assert sorted(set(counts)) == [0, 2, 4, 6]


def test_the_72_positions_of_the_class_four_linkage() -> None:
    """Four links at ten positions of the specification: turns to 1e-4 deg, rates and accelerations to 1e-5, as there."""
    from mechlab.catalog.class4_linkage.checks import rows
    from mechlab.catalog.class4_linkage.geometry import THETAS, Class4Parameters, at

    found = modes_of(CLASS_4, TURN, 1.0)
    assert found.count.tolist() == [2] * 72 and not found.lost.any() and not found.infinite.any()
    number = branches(found)
    assert set(number.ravel()) == {0, 1}
    mode = at(Class4Parameters(), TURN[:, 0])
    true = np.stack([np.exp(1j * mode.angles[n].x) for n in THETAS], axis=-1)
    near = np.argmin(np.abs(np.exp(1j * found.turns) - true[:, None]).max(axis=-1), axis=1)
    assert len({number[k, near[k]] for k in range(72)}) == 1  # one branch all the way
    for mine, theirs in ((found.rates, "v"), (found.accels, "a")):
        chosen = np.take_along_axis(mine, near[:, None, None], axis=1)[:, 0]
        np.testing.assert_allclose(chosen, np.stack([getattr(mode.angles[n], theirs) for n in THETAS], axis=-1), atol=1e-9)
    crank, angle, rate, accel, _ = rows()
    table = modes_of(CLASS_4, crank[:, None], 1.0)
    for k in range(len(crank)):
        turns = np.degrees(table.turns[k]) % 360.0
        slot = np.argmin(np.abs(turns - angle[k]).max(axis=1))
        np.testing.assert_allclose(turns[slot], angle[k], atol=1e-4)
        np.testing.assert_allclose(table.rates[k, slot], rate[k], atol=1e-5)
        np.testing.assert_allclose(table.accels[k, slot], accel[k], atol=1e-5)


def class_six(rng: np.random.Generator) -> tuple[Links, dict[str, complex], np.ndarray]:
    """Three ternary links, one on a crank and two on the ground, joined to a ring by three binary ones: an inner contour of six sides.
    Built at a random position: returned with its points and turns."""
    names = ("G0", "G1", "G2", "P01", "P02", "P10", "P12", "P20", "P21")
    z = dict(zip(names, rng.standard_normal(9) + 1j * rng.standard_normal(9), strict=True))
    crank = z["G0"] - complex(*(0.3 * rng.standard_normal(2)))
    links, turns = {"crank": {"O": 0j, "G0": complex(abs(z["G0"] - crank))}}, [np.angle(z["G0"] - crank)]
    for k, (a, b) in enumerate((("P01", "P02"), ("P10", "P12"), ("P20", "P21"))):
        turn = rng.uniform(-3.0, 3.0)
        links[f"T{k}"] = {n: (z[n] - z[f"G{k}"]) * np.exp(-1j * turn) for n in (f"G{k}", a, b)}
        turns.append(turn)
    for a, b in (("P01", "P10"), ("P12", "P21"), ("P20", "P02")):
        links[a + b] = {a: 0j, b: complex(abs(z[b] - z[a]))}
        turns.append(np.angle(z[b] - z[a]))
    return Links(links, {"O": crank, "G1": z["G1"], "G2": z["G2"]}, ("crank",)), z, np.array(turns)


def test_a_class_six_group_finds_the_position_it_was_built_at() -> None:
    """At most 20 modes; the known one is among them, random starts find no other, lengths close, and rates are those of differences."""
    rng, most = np.random.default_rng(6), 0
    for _ in range(6):
        linkage, points, turns = class_six(rng)
        found = modes_of(linkage, turns[:1], 1.0)
        assert found.bound == 20 and found.lost[0] == 0
        away = np.abs(np.exp(1j * found.turns[0]) - np.exp(1j * turns[1:])).max(axis=1)
        k = int(np.nanargmin(away))
        assert away[k] < 1e-9
        again = modes_by_trial(linkage, turns[:1], 1.0, starts=60)
        assert again.count[0] <= found.count[0]  # random starts prove nothing where they find less
        for theta in again.turns[0, : again.count[0]]:
            assert np.nanmin(np.abs(np.exp(1j * found.turns[0]) - np.exp(1j * theta)).max(axis=1)) < 1e-7
        most = max(most, int(found.count[0]))
        place = positions(linkage, turns[:1], found.turns[0, k])
        assert max(abs(complex(place[n]) - x) for n, x in points.items()) < 1e-8
        step, moved = 1e-5, []
        for s in (-1, 1):
            near = modes_of(linkage, turns[:1] + s * step).turns[0]
            moved.append(near[np.nanargmin(np.abs(np.exp(1j * near) - np.exp(1j * turns[1:])).max(axis=1))])
        slope = np.angle(np.exp(1j * (moved[1] - moved[0]))) / (2 * step)
        curve = np.angle(np.exp(1j * (moved[1] + moved[0] - 2 * found.turns[0, k]))) / step**2
        scale = 1.0 + np.abs(slope).max() ** 3
        np.testing.assert_allclose(found.rates[0, k], slope, atol=1e-6 * scale)
        np.testing.assert_allclose(found.accels[0, k], curve, atol=1e-3 * scale)
    assert most >= 4


def test_dyads_in_a_row_have_ends_at_infinity() -> None:
    """A four-bar with a dyad on its coupler: 2 x 2 modes, of 6 paths the others end at infinity."""
    linkage = Links(
        {
            "crank": {"O": 0j, "A": 1 + 0j}, "coupler": {"A": 0j, "B": 3 + 0j, "M": 1.5 + 1j}, "rocker": {"C": 0j, "B": 2.5 + 0j},
            "rod": {"M": 0j, "N": 2 + 0j}, "arm": {"Q": 0j, "N": 2 + 0j},
        },
        {"O": 0j, "C": 3.5 + 0j, "Q": 1 + 3j}, ("crank",),
    )  # fmt: skip
    found = modes_of(linkage, [[0.7]])
    assert found.count[0] == 4 and found.infinite[0] == 2 and found.lost[0] == 0


def test_bilinear_equations_have_as_many_solutions_as_paths() -> None:
    """Random coefficients: all binomial(2 n, n) ends are finite, different, and solve the equations."""
    rng = np.random.default_rng(1)
    for n in (1, 2, 3):
        u, v = (rng.standard_normal((2 * n, n + 1)) + 1j * rng.standard_normal((2 * n, n + 1)) for _ in range(2))
        ends = all_solutions(Bilinear(u, v))
        assert ends.finite.sum() == path_count(n) and not ends.lost
        one = np.ones((path_count(n), 1))
        left = (np.hstack([one, ends.x]) @ u.T) * (np.hstack([one, ends.y]) @ v.T)
        assert np.abs(left - 1.0).max() < 1e-6
        gaps = np.abs(ends.x[:, None] - ends.x[None]).max(axis=-1) + np.eye(path_count(n))
        assert gaps.min() > 1e-6


@pytest.mark.parametrize(
    ("links", "fixed", "drives", "word"),
    [
        ({"a": {"O": 0j, "A": 1 + 0j}}, {"O": 0j}, ("b",), "driven link"),
        ({"a": {"X": 0j, "A": 1 + 0j}}, {"O": 0j}, (), "hangs on nothing"),
        ({"a": {"O": 0j, "A": 1 + 0j}, "b": {"A": 0j, "B": 1 + 0j}}, {"O": 0j}, (), "2 more drives are needed"),
        ({"a": {"O": 0j, "A": 1 + 0j}, "b": {"A": 0j, "P": 1 + 0j}}, {"O": 0j, "P": 1j}, ("a",), "1 constraints too many"),
        ({"a": {"M": 0j, "A": 1 + 0j}, "b": {"A": 0j, "M": 1 + 0j}}, {"O": 0j}, (), "not connected with the ground"),
    ],
)
def test_what_is_no_group_is_refused(links: dict, fixed: dict, drives: tuple, word: str) -> None:
    with pytest.raises(MechlabError, match=word):
        modes_of(Links(links, fixed, drives), np.zeros((1, len(drives))))


def test_a_linkage_that_does_not_close_has_no_mode() -> None:
    """With BC = 0.27 m no position exists between -104.26 and -75.74 deg; beside it two modes are near each other."""
    short = Links({**CLASS_4.links, "3": {"C": 0j, "B": 0.27 + 0j}}, CLASS_4.fixed, CLASS_4.drives)
    found = modes_of(short, np.radians([[-104.2615], [-104.2614], [-90.0], [-75.7385]]))
    assert found.count.tolist() == [2, 0, 0, 2]
