"""The lessons run, what they keep of their outputs is what they give today, and their numbers are right."""

from __future__ import annotations

import base64
import importlib.util
import io
import math
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "assets" / "lessons"
LESSONS = sorted(FOLDER.glob("*.ipynb"))
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


def _runner() -> ModuleType:
    spec = importlib.util.spec_from_file_location("lesson_notebooks", Path(__file__).parent / "notebooks.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


notebooks = _runner()


@pytest.fixture(scope="module")
def ran() -> dict[str, tuple[dict[str, Any], list[Any]]]:
    """Name of the lesson -> its namespace and outputs."""
    return {path.stem: notebooks.run(notebooks.read(path)) for path in LESSONS}


def words(outputs: list[dict[str, Any]]) -> str:
    """Printed text and tables of a cell; pictures are not compared."""
    texts = [x.get("text", []) or x["data"].get("text/html", x["data"]["text/plain"]) for x in outputs]
    return "".join(line for text in texts for line in text)


def test_they_are_numbered_and_small() -> None:
    assert len(LESSONS) >= 4 and [p.stem[:2] for p in LESSONS] == [f"{k}_" for k in range(1, len(LESSONS) + 1)]
    assert all(p.stat().st_size < 100_000 for p in LESSONS)


@pytest.mark.parametrize("path", LESSONS, ids=lambda p: p.stem)
def test_is_a_valid_notebook_without_network_or_files(path: Path) -> None:
    nbformat = pytest.importorskip("nbformat")
    nbformat.validate(nbformat.read(path, as_version=4))
    assert "http" not in path.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)]+)\)", path.read_text(encoding="utf-8")):
        assert (FOLDER / target).is_file(), target


@pytest.mark.parametrize("path", LESSONS, ids=lambda p: p.stem)
def test_every_kept_output_can_be_seen(path: Path) -> None:
    """A reader who runs nothing sees text, a table, or a picture of many colours in place of each output."""
    image = pytest.importorskip("PIL.Image")
    for cell in notebooks.read(path)["cells"]:
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            assert output["output_type"] == "stream" or "text/html" in data or "image/png" in data
            if "image/png" in data:
                picture = image.open(io.BytesIO(base64.b64decode(data["image/png"]))).convert("RGB")
                assert picture.width > 300 and len(picture.getcolors(1_000_000)) > 15


@pytest.mark.machine
@pytest.mark.printed
@pytest.mark.parametrize("path", LESSONS, ids=lambda p: p.stem)
def test_kept_outputs_are_current(path: Path, ran: dict[str, tuple[dict[str, Any], list[Any]]]) -> None:
    """Words to the letter; numbers to 1 %, and not below 1e-4, where the last digits of a residual are the machine's."""
    kept = [c["outputs"] for c in notebooks.read(path)["cells"] if c["cell_type"] == "code"]
    made = ran[path.stem][1]
    assert len(kept) == len(made)
    for one, two in zip(map(words, kept), map(words, made), strict=True):
        assert NUMBER.sub("#", one) == NUMBER.sub("#", two), "run: python tests/lessons/notebooks.py"
        a, b = ([float(x) for x in NUMBER.findall(text)] for text in (one, two))
        np.testing.assert_allclose(a, b, rtol=1e-2, atol=1e-4)


@pytest.mark.printed
def test_a_loop_in_twenty_lines(ran: dict[str, tuple[dict[str, Any], list[Any]]]) -> None:
    names = ran["1_a_loop_in_twenty_lines"][0]
    source = next(c for c in notebooks.read(LESSONS[0])["cells"] if c["cell_type"] == "code")["source"]
    assert sum(bool(line.strip()) for line in source) <= 20

    # where two circles meet: |C - B| = coupler, |C - D| = rocker, the upper one
    B, D = 0.1 * np.exp(1j * 1.0), 0.3 + 0.0j
    along, d = (B - D) / abs(B - D), abs(B - D)
    foot = (0.25**2 - 0.3**2 + d**2) / (2 * d)
    C = D + along * (foot - 1j * math.sqrt(0.25**2 - foot**2))
    for engine in ("pinocchio", "mujoco"):
        assert names["answers"][engine]["rocker_angle"] == pytest.approx(np.angle(C - D), abs=1e-9)
    assert names["schoolbook"] == pytest.approx(np.angle(C - D), abs=1e-12)

    # energy of three uniform rods of 1 kg/m that fall freely, from the recorded angles and rates
    run = names["run"]
    assert run.health.trusted
    a, c, r = (run.channel(n) for n in ("crank_angle", "coupler_joint", "rocker_angle"))
    va, vc, vr = (run.channel(f"{n}_rate") for n in ("crank_angle", "coupler_joint", "rocker_angle"))
    coupler, spin = a + c, va + vc
    pin, middle = 0.1 * np.exp(1j * a), 0.15 * np.exp(1j * coupler)
    speed = 1j * va * pin + 1j * spin * middle
    kinetic = 0.5 * (0.1**3 / 3 * va**2 + 0.3**3 / 12 * spin**2 + 0.25**3 / 3 * vr**2 + 0.3 * np.abs(speed) ** 2)
    height = 0.1 * 0.05 * np.sin(a) + 0.3 * (pin + middle).imag + 0.25 * 0.125 * np.sin(r)
    energy = kinetic + 9.81 * height
    # rods have a small thickness here (width 8 % of the length), and steps of 1 ms leave 1e-5
    assert np.ptp(energy) < 5e-3 * np.ptp(kinetic)
    gap = pin + 2 * middle - (0.3 + 0.25 * np.exp(1j * r))
    assert np.abs(gap).max() < 1e-5


@pytest.mark.printed
def test_the_printed_law_that_fails(ran: dict[str, tuple[dict[str, Any], list[Any]]]) -> None:
    names = ran["6_the_printed_law_that_fails"][0]
    p = names["train"].parameters
    z1, _, z3, z4, _, z6 = p.teeth
    a, b = z1 / (z1 + z3), z4 / (z4 + z6)
    # Willis' equation gives the carriers from the blocks; constant moments and inertias make the power a straight line
    for engine, run in names["runs"].items():
        w1, w3 = run.channel("w1"), run.channel("w3")
        np.testing.assert_allclose(run.channel("w_H1"), a * w1 + (1 - a) * w3, rtol=0, atol=1e-6)
        power = 100.0 * (a * w1 + (1 - a) * w3) - 200.0 * (b * w1 + (1 - b) * w3)
        assert np.sum(np.diff(np.sign(power)) != 0) == 1 and power[0] < 0 < power[-1]
        np.testing.assert_allclose(np.diff(power) / np.diff(run.t), names["slopes"][engine], rtol=1e-6)
    # printed in the source: 100 and 50 rad/s at the point; the run passes it after 0.1 s
    assert np.concatenate(list(names["crossings"].values())) == pytest.approx([0.1] * 3, abs=1e-6)
    assert names["runs"]["mujoco"].at("w_H1", 0.1) == pytest.approx(100.0, abs=1e-6)
    assert min(names["slopes"].values()) > 0


@pytest.mark.printed
def test_fast_or_right(ran: dict[str, tuple[dict[str, Any], list[Any]]]) -> None:
    names = ran["5_fast_or_right"][0]
    soft = [p for p in names["found"].points if p.default and p.ok]
    # MuJoCo 4.0.0: 2.0 m at every step from 50 to 0.78 ms, the diameter of the path
    assert len(soft) >= 4 and min(p.error for p in soft) > 1.9 and max(p.error for p in soft) < 2.001
    assert max(p.step for p in soft) / min(p.step for p in soft) >= 8
    hard = [p for p in names["found"].points if p.method.endswith("hard") and p.ok]
    assert min(p.error for p in hard) < 1e-2
    assert not names["run"].health.trusted
    # the exact equation of the chain, to 13 digits (benchmark A02, N = 2): x, y of the first pin
    for t, x, y in (
        (1, -0.19502030195, -0.980799205662),
        (5, -0.811310461003, -0.584615545352),
        (10, 0.328458111536, 0.94451853818),
    ):
        assert math.hypot(names["careful"].at("x", t) - x, names["careful"].at("y", t) - y) < 1e-4  # as asked


@pytest.mark.printed
def test_drive_it(ran: dict[str, tuple[dict[str, Any], list[Any]]]) -> None:
    names = ran["3_drive_it"][0]
    # by hand: cart M = 1, two arms m = 0.5 of uniform mass, the bar across n = 0.2 only translates; lean a, cart x with drag 0.5:
    # (M + 2 m + n) x'' - (m + n) l a'' = f - 0.5 x',   -(m + n) l x'' + (2 m / 3 + n) l^2 a'' = (m + n) g l a
    M, m, n, arm = 1.0, 0.5, 0.2, 0.5
    mass = np.array([[M + 2 * m + n, -(m + n) * arm], [-(m + n) * arm, (2 * m / 3 + n) * arm**2]])
    K, C = np.diag([0.0, -(m + n) * 9.81 * arm]), np.diag([0.5, 0.0])
    A = np.vstack([np.hstack([np.zeros((2, 2)), np.eye(2)]), -np.linalg.solve(mass, np.hstack([K, C]))])
    # bars have a width of 8 % of their length here, which adds 0.3 % to their moment of inertia
    by_hand = np.sort(np.linalg.eigvals(A).real)
    np.testing.assert_allclose(names["poles"], by_hand, rtol=5e-3, atol=1e-6)
    assert by_hand[-1] > 6  # it falls

    model, gain = names["model"], names["gain"]
    assert np.linalg.eigvals(model.A - model.B @ gain).real.max() < -1
    held, caught, pushed = names["held"], names["caught"], names["pushed"]
    assert all(run.health.trusted for run in (held, caught, pushed))
    for run in (held, caught, pushed):  # the loop is closed: both arms lean alike and the bar across stays level
        np.testing.assert_allclose(run["left_angle"], run["right_angle"], atol=1e-4)
        np.testing.assert_allclose(run["left_angle"] + run["top_joint"], 0.0, atol=1e-4)
    assert abs(held["left_angle"][-1] - math.pi / 2) < 1e-3 and abs(held["x"][-1]) < 5e-3
    assert abs(caught["left_angle"][-1] - math.pi / 2) < 2e-2 and abs(caught["x"][-1]) > 2
    # the motor: its force is stall (1 - rate / no load), and force = d/dt of the momentum of all, plus drag
    np.testing.assert_allclose(pushed["x_force"], 10 * (1 - pushed["x_rate"] / 2), atol=1e-9)
    lean, spin = pushed["left_angle"] - math.pi / 2, pushed["left_angle_rate"]
    momentum = (M + 2 * m + n) * pushed["x_rate"] - (m + n) * arm * np.cos(lean) * spin
    force = pushed["x_force"] - 0.5 * pushed["x_rate"]
    done = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(pushed.t))])
    # the trapezoidal rule over samples of 1 ms
    np.testing.assert_allclose(momentum, done, atol=1e-4)


@pytest.mark.printed
def test_your_robots_file(ran: dict[str, tuple[dict[str, Any], list[Any]]]) -> None:
    names, outputs = ran["4_your_robots_file"]
    # where two circles meet, as in the first lesson, in the angles of the file: 1, -0.6 and 1.6 rad are in its origins
    B, D = 0.1 * np.exp(1j * 1.5), 0.3 + 0.0j
    d = abs(B - D)
    foot = (0.25**2 - 0.3**2 + d**2) / (2 * d)
    C = D + (B - D) / d * (foot - 1j * math.sqrt(0.25**2 - foot**2))
    for engine in ("pinocchio", "mujoco"):
        assert names["answers"][engine]["rocker_joint"] == pytest.approx(np.angle(C - D) - 1.6, abs=1e-9)
    # the zero pose of the file, by its three angles: how far the pin is open
    ends = 0.1 * np.exp(1j) + 0.3 * np.exp(0.4j), 0.3 + 0.25 * np.exp(1.6j)
    opened = abs(((ends[0] - ends[1]) * np.exp(-0.4j)).imag)  # along y of the coupler, in whose axes its frame stands
    assert opened == pytest.approx(float(re.search(r"zero pose by ([\d.]+)", words(outputs[1])).group(1)), rel=1e-2)  # type: ignore[union-attr]
    assert "freedoms: 3" in words(outputs[0]) and "freedoms: 1" in words(outputs[1])
    # work of the motor = energy gained, from the recorded angles, rates and torque; rods as in the URDF, weight along the axes
    run = names["run"]
    assert run.health.trusted
    a, c, r = (run.channel(f"{n}_joint") + z for n, z in (("crank", 1.0), ("coupler", -0.6), ("rocker", 1.6)))
    va, vc, vr = (run.channel(f"{n}_joint_rate") for n in ("crank", "coupler", "rocker"))
    spin, speed = va + vc, 1j * va * 0.1 * np.exp(1j * a) + 1j * (va + vc) * 0.15 * np.exp(1j * (a + c))
    kinetic = 0.5 * (
        0.1 * 0.1**2 / 3 * va**2 + 0.3 * (0.3**2 / 12 * spin**2 + np.abs(speed) ** 2) + 0.25 * 0.25**2 / 3 * vr**2
    )
    stretch = np.abs(0.3 + 0.1 * np.exp(1j * r) - (0.3 - 0.1j)) - 0.1
    torque = 0.5 * (1.0 - va / (2.0 * math.pi))
    power = torque * va
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(run.t))])
    energy = kinetic + 0.5 * 200.0 * stretch**2
    assert np.ptp(energy - work) < 1e-3 * np.ptp(energy)  # trapezoidal rule between samples, inertias with six digits
    cured = {row.name.rpartition("/")[2]: row.verdict for row in names["ml"].audit([names["folder"]]).rows}
    assert cured["soft.xml"] == "do not trust" and cured["cured.xml"] == "healthy"
    # the cured file against the closed form: coupler and cranks of a parallelogram keep their angles to each other
    mujoco = pytest.importorskip("mujoco")
    apart = {}
    for name in ("soft.xml", "cured.xml"):
        model = mujoco.MjModel.from_xml_path(str(names["folder"] / name))
        data, worst = mujoco.MjData(model), 0.0
        while data.time < 0.4:
            mujoco.mj_step(model, data)
            crank, _, rocker = data.qpos
            worst = max(worst, abs(crank - rocker))
        apart[name] = worst
    assert apart["soft.xml"] > 1e-2 and apart["cured.xml"] < 1e-4


@pytest.mark.printed
def test_gears_on_a_moving_carrier(ran: dict[str, tuple[dict[str, Any], list[Any]]]) -> None:
    names = ran["2_gears_on_a_moving_carrier"][0]
    # Willis: z_s (w_s - w_c) = -z_r (w_r - w_c)
    for engine in ("pinocchio", "mujoco"):
        carrier = names["two"][engine]["carrier_angle_rate"]
        assert 20 * (3.6 - carrier) == pytest.approx(-52 * (1.0 - carrier), abs=1e-9)
    run = names["run"]
    assert run.health.trusted
    np.testing.assert_allclose(run["sun_angle"], 3.6 * run["carrier_angle"], atol=1e-4)
    # d/dt of the kinetic energy = power of motor and load; energy of six bodies from the recorded speeds
    ws, wc = run["sun_angle_rate"], run["carrier_angle_rate"]
    wp = wc + run["planet_0_angle_rate"]
    discs = (0.5 * 0.1 * 0.02**2, 0.5 * 0.15 * 0.04**2 + 3 * 0.06 * 0.036**2, 3 * 0.5 * 0.06 * 0.016**2)
    energy = 0.5 * (discs[0] * ws**2 + discs[1] * wc**2 + discs[2] * wp**2)
    power = run["sun_angle_force"] * ws + run["carrier_angle_force"] * wc
    done = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(run.t))])
    np.testing.assert_allclose(energy, done, atol=2e-3 * energy.max())  # the trapezoidal rule over samples of 1 ms
    np.testing.assert_allclose(run["ring_held_load"][-1], 52 / 20 * run["sun_angle_force"][-1], rtol=1e-3)
