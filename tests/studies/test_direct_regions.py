"""The question `regions`: points in a region of functions, and the printed law chi(-f) = not chi(f)."""

import json

import numpy as np
import pytest

from mechlab import api
from mechlab.cli import main
from mechlab.studies.direct import NAMES
from mechlab.studies.direct.table import DIRECT

WITNESSES = ("min and max", "R-functions", "sets")


def test_the_printed_law_holds_off_the_border_only(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "regions", "f=-2,-1e-300,0,1e-300,3", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    for witness in WITNESSES:
        said = document["answers"][witness]
        # {-f >= 0} is closed and holds the border, not chi(f) does not.
        assert said["inside"] == [1, 1, 1, 0, 0] and said["inside_by_law"] == [1, 1, 0, 0, 0] and said["broken"] == 1
    assert "at 1 of 5 points: they lie on a border" in document["message"]
    assert "the region is ~f, as none is given" in document["message"]
    assert "as none is given" not in str(api.solve("regions", f=[1.0], region="~f"))


@pytest.mark.parametrize(
    ("region", "f", "g", "inside", "by_law"),
    [
        # By hand, a point each: a set and its negative both hold the border f = 0.
        ("f & ~g", [1, 1, 0, -1], [-1, 0, 0, 0], [1, 1, 1, 0], [1, 0, 0, 0]),
        ("~(f & g)", [0, 0, 0, -1], [0, 1, -1, 0], [1, 1, 1, 1], [0, 0, 1, 1]),
        ("~(f | g)", [0, 0, -1, 1], [-1, 0, -1, -1], [1, 1, 1, 0], [0, 0, 1, 0]),
        ("f | ~f", [-1, 0, 1], [], [1, 1, 1], [1, 1, 1]),
        ("f & ~f", [-1, 0, 1], [], [0, 1, 0], [0, 0, 0]),
        ("~~f", [-1, 0, 1], [], [0, 1, 1], [0, 1, 1]),
    ],
)
def test_borders_by_hand(region: str, f: list[float], g: list[float], inside: list[int], by_law: list[int]) -> None:
    found = api.solve("regions", region=region, f=f, **({"g": g} if g else {}))
    assert found.exit_code == 0
    for witness in WITNESSES:
        assert list(found[witness]["inside"]) == inside, witness
        assert list(found[witness]["inside_by_law"]) == by_law, witness
        assert found[witness]["broken"] == sum(a != b for a, b in zip(inside, by_law, strict=True))


@pytest.mark.parametrize("region", ["f & (g | ~h)", "~(f | g & ~h) & k", "(f | g) & (h | k) | ~f & ~k"])
def test_off_the_border_it_is_the_algebra_of_sets(region: str) -> None:
    rng = np.random.default_rng(3)
    values = {n: rng.standard_normal(500) for n in "fghk" if n in region}
    truth = eval(region, {}, {n: x >= 0.0 for n, x in values.items()})  # numpy's own and, or, not
    found = api.solve("regions", region=region, **values)
    for witness in WITNESSES:
        np.testing.assert_array_equal(found[witness]["inside"], truth)
        assert found[witness]["broken"] == 0.0


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (["f=1", "region=f & (f + f)"], "'f + f' is no function"), (["f=1", "region=f &"], "joined by &"),
        (["f=1", "region=f & x"], "'x' does not exist"), (["f=1", "region=f.real"], "'f.real' is no function"),
        (["f=1", "region=-f"], "'-f' is no function"), (["region=f & g", "f=1"], "g missing"),
        (["f=1,2", "g=1,2,3", "region=f&g"], "f: 2, g: 3"), (["f=1", "g=1"], "does not name it"), (["f=1m"], "without a unit"),
        (["q=1"], "'q' does not exist"), (["f=1", "region=" + "~" * 300 + "f"], "301 characters"),
    ],
)  # fmt: skip
def test_what_is_no_region(keys: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "regions", *keys]) == 1
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1


def test_the_direct_questions_are_listed_and_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert tuple(DIRECT) == NAMES == ("toolpath", "bspline", "regions", "assur")
    for name, words in (("bspline", "arrives exactly at its end"), ("regions", "border included"), ("assur", "all assembly modes")):
        assert main(["show", name]) == 0
        assert words in capsys.readouterr().out
    assert main(["solve", "--help"]) == 0
    assert "NAME|toolpath|bspline|regions|assur" in capsys.readouterr().out
