"""The question `assur`: its file, both witnesses, table and curves, and what is said of bad files."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.catalog.platform_3rrr.build import PlatformParameters
from mechlab.cli import main
from mechlab.errors import MechlabError

FOURBAR: dict[str, Any] = {
    "fixed": {"O": [0, 0], "C": [400, 0]}, "drives": ["crank"], "unit": "mm", "name": "four-bar",
    "links": {"crank": ["O", "A", 100], "coupler": ["A", "B", 350], "rocker": {"C": [0, 0], "B": [200, 0]}},
}  # fmt: skip


def write(folder: Path, document: Any, name: str = "links.json") -> str:
    path = folder / name
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return str(path)


def test_a_fourbar_by_the_law_of_cosines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = write(tmp_path, FOURBAR)
    assert main(["solve", "assur", f"links={file}", "crank=40deg", "crank_rate=2", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)

    def rockers(crank: float) -> list[float]:
        d = 0.1 * np.exp(1j * crank) - 0.4
        between = np.arccos((0.2**2 + abs(d) ** 2 - 0.35**2) / (2 * 0.2 * abs(d)))
        return [float(np.angle(d * np.exp(s * 1j * between))) for s in (-1, 1)]

    phi, step = np.radians(40.0), 1e-6
    slopes = np.subtract(rockers(phi + step), rockers(phi - step)) / step  # two rad/s
    for witness in ("homotopy", "newton"):
        said = document["answers"][witness]
        assert said["mode_count"] == 2
        order = np.argsort(said["rocker"])
        np.testing.assert_allclose(np.array(said["rocker"])[order], sorted(rockers(phi)), atol=1e-12)
        np.testing.assert_allclose(np.array(said["rocker_rate"])[order], slopes[np.argsort(rockers(phi))], atol=1e-8)
    assert document["max_difference"] < 1e-9 and "at most 2 modes" in document["answers"]["homotopy"]["notes"][0]


def test_six_modes_of_the_3rrr(tmp_path: Path) -> None:
    """The platform of the catalog with drives at which it has six: its own answer, by the polynomial of degree 6, has the same poses."""
    p = PlatformParameters(platform=0.4, leg=0.5)
    drives = {"drive_1": 1.19, "drive_2": 0.54, "drive_3": -0.72}
    known = api.solve("platform_3rrr", platform=0.4, leg=0.5, **drives).answers["analytic"]
    assert len(known.modes) == 6
    base, corners = p.pivots, p.corners
    links: dict[str, Any] = {"platform": {f"P{k}": [c.real, c.imag] for k, c in enumerate(corners)}}
    links |= {f"drive_{k + 1}": [f"A{k}", f"B{k}", p.cranks[k]] for k in range(3)}
    links |= {f"leg_{k + 1}": [f"B{k}", f"P{k}", p.legs[k]] for k in range(3)}
    fixed = {f"A{k}": [z.real, z.imag] for k, z in enumerate(base)}
    file = write(tmp_path, {"fixed": fixed, "links": links, "drives": list(drives)})
    found = api.solve("assur", links=file, **drives, drive_1_rate=1.0)
    for witness in ("homotopy", "newton"):
        said = found[witness]
        assert said["mode_count"] == 6
        mine = np.sort(np.asarray(said["platform"]))
        np.testing.assert_allclose(mine, np.sort([m["alpha"] for m in known.modes]), atol=1e-9)


def test_a_csv_table_and_branches(tmp_path: Path) -> None:
    """The same four-bar in a table of points; a turn of its crank in two branches; the CSV that is written closes the loop."""
    text = "link, point, x, y, drive\nground,O,0,0,\nground,C,0.4,0,\ncrank,O,0,0,yes\ncrank,A,0.1,0,\n"
    text += "coupler,A,0,0,\ncoupler,B,0.35,0,\nrocker,C,0,0,\nrocker,B,0.2,0,\n"
    angles = np.linspace(-3.0, 3.0, 61).tolist()
    table, curves = tmp_path / "t.csv", tmp_path / "c.png"
    by_csv = api.solve("assur", links=write(tmp_path, text, "l.csv"), crank=angles, crank_rate=1.0, table=str(table), curves=str(curves))
    by_json = api.solve("assur", links=write(tmp_path, FOURBAR), crank=angles, crank_rate=1.0)
    two = by_csv.answers["homotopy"].details["branches"]
    assert [len(b["position"]) for b in two] == [61, 61]
    np.testing.assert_allclose(two[0]["rocker"], by_json.answers["homotopy"].details["branches"][0]["rocker"], atol=1e-9)
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 122 and {r["branch"] for r in rows} == {"1", "2"}
    for r in rows:
        crank, coupler, rocker = (np.exp(1j * float(r[n])) for n in ("crank", "coupler", "rocker"))
        assert abs(0.1 * crank + 0.35 * coupler - 0.4 - 0.2 * rocker) < 1e-12
        rate = 0.1j * crank + 0.35j * coupler * float(r["coupler_rate"]) - 0.2j * rocker * float(r["rocker_rate"])
        assert abs(rate) < 1e-11
    assert curves.stat().st_size > 5000


def test_where_nothing_closes_there_is_no_solution(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = write(tmp_path, FOURBAR | {"links": FOURBAR["links"] | {"coupler": ["A", "B", 50]}})
    assert main(["solve", "assur", f"links={file}", "crank=180deg"]) == 4


def test_where_a_part_moves_with_the_drives_held(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A rhombus folded onto its ground: A lies on D, so that B may be anywhere on a circle; elsewhere it has two modes."""
    rhombus = {"fixed": {"O": [0, 0], "D": [1, 0]}, "links": {"a": ["O", "A", 1], "b": ["A", "B", 1], "c": ["B", "D", 1]}, "drives": ["a"]}
    file = write(tmp_path, rhombus)
    assert main(["solve", "assur", f"links={file}", "a=0"]) == 3
    said = capsys.readouterr()
    assert "a part moves freely though the drives are held" in said.out and "no assembly" not in said.out + said.err
    found = api.solve("assur", links=file, a=np.radians([-90.0, 0.0, 45.0, 120.0]))
    assert found.exit_code == 0 and "at 1 position, the first of them 2 (a = 0 deg)" in str(found.to_dict()["message"])
    for witness in ("homotopy", "newton"):
        assert list(found[witness]["mode_count"]) == [2.0, 0.0, 2.0, 2.0]


@pytest.mark.parametrize(
    ("change", "keys", "word"),
    [
        ({}, [], "crank is missing"),
        ({}, ["crank=1", "rocker=2"], "rocker"),
        ({}, ["crank=1", "table=a.txt"], ".csv"),
        ({"drives": []}, [], "1 more drives"),
        ({"drives": ["cranc"]}, ["crank=1"], "crank"),
        ({"links": FOURBAR["links"] | {"rocker": ["C", "E", 0.6]}}, ["crank=1"], "nothing is pinned to B, E"),
        ({"links": {"crank": ["O", "A"]}}, ["crank=1"], "length"),
        ({"links": FOURBAR["links"] | {"crank": ["O", "A", 0]}}, ["crank=1"], "above 0"),
        ({"links": FOURBAR["links"] | {"crank": ["O", "O", 1]}}, ["crank=1"], "two points"),
        ({"links": {"crank": {"O": [0, 0], "A": [1, "x"]}}}, ["crank=1"], "number"),
        ({"unit": "kg"}, ["crank=1"], "unit"),
        ({"masses": 1}, ["crank=1"], "masses"),
        ({"fixed": None}, ["crank=1"], "objects"),
    ],
)
def test_bad_input(change: dict, keys: list[str], word: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = write(tmp_path, FOURBAR | change)
    assert main(["solve", "assur", f"links={file}", *keys]) == 1
    said = capsys.readouterr().err
    assert word in said and "Traceback" not in said and "internal" not in said


HEAD = "link,point,x,y\n"


@pytest.mark.parametrize("text", ["", "a,b\n", HEAD + "crank,O,zero,0\n", HEAD + ",O,1,0\n", HEAD + "ground,O,0,0\n", "{"])
def test_bad_files(text: str, tmp_path: Path) -> None:
    for name in ("a.csv", "a.json"):
        with pytest.raises(MechlabError, match="links"):
            api.solve("assur", links=write(tmp_path, text, name), crank=1.0)
    with pytest.raises(MechlabError, match="cannot read"):
        api.solve("assur", links=str(tmp_path / "nothing.json"), crank=1.0)


SLIDER = {
    "fixed": {"O": [0, 0]}, "unit": "mm", "links": {"crank": ["O", "A", 100], "rod": ["A", "B", 300]}, "drives": ["crank"],
    "slides": {"x": {"point": "B", "guide": "ground", "through": [0, 20], "along": [1, 0]}},
}  # fmt: skip


def test_a_slider_crank_from_a_file(tmp_path: Path) -> None:
    found = api.solve("assur", links=write(tmp_path, SLIDER), crank=0.7, crank_rate=10.0)
    y = 0.02 - 0.1 * np.sin(0.7)
    places = 0.1 * np.cos(0.7) + np.sqrt(0.09 - y * y) * np.array([-1.0, 1.0])
    for witness in ("homotopy", "newton"):
        np.testing.assert_allclose(np.sort(found[witness]["x"]), places, atol=1e-14)
    assert found.units["x"] == "m" and found.units["x_rate"] == "m/s" and found.units["rod"] == "rad"
    table, curves = tmp_path / "t.csv", tmp_path / "c.png"
    api.solve("assur", links=write(tmp_path, SLIDER), crank=np.linspace(0.0, 6.2, 40), crank_rate=1.0, table=str(table), curves=str(curves))
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert len(rows) == 80 and {"x", "x_rate", "x_accel"} <= set(rows[0]) and curves.stat().st_size > 5000


@pytest.mark.parametrize("slides", [["B"], {"x": ["B"]}, {"x": {"point": "B", "guide": "ground", "through": [0, 0]}},
                                    {"x": {"point": "B", "guide": "ground", "through": 0, "along": [1, 0]}}])  # fmt: skip
def test_bad_slides_of_a_file(tmp_path: Path, slides: Any) -> None:
    with pytest.raises(MechlabError, match="slide"):
        api.solve("assur", links=write(tmp_path, {**SLIDER, "slides": slides}), crank=0.7)
