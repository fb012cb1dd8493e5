"""`mechlab cycle`: motion against the closed form, forces by three witnesses, transmission, centres, files."""

import csv
import json

import numpy as np
import pytest

import mechlab as ml
from mechlab import api
from mechlab.analytic import fourbar as closed_form
from mechlab.catalog import fourbar
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.formats.dxf import dxf_polylines
from mechlab.studies.cycle.cycle import run_cycle

P = fourbar.Parameters()
RATE, ACCEL = 5.0, -2.0


@pytest.fixture(scope="module")
def cycle():
    return run_cycle(
        fourbar.build(P, "minimal"),
        "fourbar",
        {"crank_angle_rate": RATE, "crank_angle_accel": ACCEL, "rocker_angle_force": 1.5},
    )


def test_motion_is_that_of_the_closed_form(cycle):
    phi = cycle["crank_angle"]
    assert phi[-1] - phi[0] == pytest.approx(2 * np.pi) and len(phi) == 73
    motion = closed_form.solve(*P.lengths, phi, RATE, ACCEL, P.mode)
    assert np.allclose(np.exp(1j * cycle["rocker_angle"]), np.exp(1j * motion.rocker_angle), atol=1e-12)
    for name, exact in (("rocker_angle_rate", motion.rocker_rate), ("rocker_angle_accel", motion.rocker_accel),
                        ("coupler_angle_rate", motion.coupler_rate), ("coupler_angle_accel", motion.coupler_accel)):  # fmt: skip
        assert np.allclose(cycle[name], exact, atol=1e-10)


def test_forces_of_three_witnesses(cycle):
    links = [
        closed_form.LinkMass(b.inertia.mass, b.inertia.com[0], b.inertia.matrix()[1, 1]) for b in cycle.mechanism.bodies
    ]
    bar = closed_form.MovingFourbar(*P.lengths, *links, mode=P.mode)
    own = closed_form.pin_forces(bar, cycle["crank_angle"], RATE, ACCEL, (0.0, -P.gravity), 1.5)
    assert np.allclose(cycle["crank_angle_force"], own.crank_torque, atol=1e-11)
    for name, force in (
        ("pin", own.force_c),
        ("crank_angle", own.force_a),
        ("coupler_joint", own.force_b),
        ("rocker_angle", own.force_d),
    ):
        assert np.allclose(np.column_stack([cycle[f"{name}_fx"], cycle[f"{name}_fz"]]), force, atol=1e-11)
    assert np.allclose(np.column_stack([cycle["shaking_fx"], cycle["shaking_fz"]]), own.shaking_force, atol=1e-11)
    # The closed form counts moments counter-clockwise seen from -Y: about -y.
    assert np.allclose(-cycle["shaking_my"], own.shaking_moment, atol=1e-11)
    (gap,) = cycle.witnesses.values()
    assert gap < 1e-10  # Pinocchio against MuJoCo, at nine positions
    assert "pin_fy" in cycle.zero


def test_ground_reactions_are_weight_and_shaking_force(cycle):
    on_ground = -cycle["crank_angle_fz"] - cycle["rocker_angle_fz"]
    assert np.allclose(on_ground, cycle["shaking_fz"] - cycle.mechanism.total_mass * P.gravity, atol=1e-11)


def test_transmission(cycle):
    motion = closed_form.solve(*P.lengths, cycle["crank_angle"], 1.0)
    folded = np.minimum(motion.transmission_angle, np.pi - motion.transmission_angle)
    assert cycle.output == "rocker_angle"
    assert np.allclose(cycle["pin_transmission_angle"], folded, atol=1e-7)  # arcsin near 1 halves the digits
    assert np.allclose(cycle["velocity_ratio"], motion.rocker_rate, atol=1e-12)
    assert np.allclose(cycle["mechanical_advantage"] * cycle["velocity_ratio"], 1.0)


def test_instant_centres_obey_kennedy(cycle):
    def centre(a, b):
        return np.column_stack([cycle[f"centre_{a}_{b}_x"], cycle[f"centre_{a}_{b}_z"]])

    pins = [("ground", "crank", (0.0, 0.0)), ("ground", "rocker", (P.ground, 0.0))]
    for a, b, at in pins:
        assert np.allclose(centre(a, b), at, atol=1e-12)
    assert np.allclose(centre("crank", "coupler"), np.column_stack([cycle["B_x"], cycle["B_z"]]), atol=1e-10)
    assert np.allclose(centre("coupler", "rocker"), np.column_stack([cycle["C_x"], cycle["C_z"]]), atol=1e-10)
    for i, j, k in (("ground", "crank", "coupler"), ("crank", "coupler", "rocker"), ("ground", "crank", "rocker")):
        one, two, three = centre(i, j), centre(j, k), centre(i, k)
        d, e = two - one, three - one
        size = np.linalg.norm(d, axis=1) * np.linalg.norm(e, axis=1)
        fine = np.isfinite(size) & (size > 1e-6)
        assert np.abs((d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0])[fine] / size[fine]).max() < 1e-8  # on one line


def test_a_drive_that_cannot_turn_fully_stays_inside_its_limits():
    bars = fourbar.Parameters(crank=0.3, coupler=0.2, rocker=0.25, ground=0.4)
    found = run_cycle(fourbar.build(bars, "minimal"))
    (low, high) = closed_form.crank_limits(*bars.lengths).ranges[0]
    phi = found["crank_angle"]
    assert (
        any(low < phi[0] - t and phi[-1] - t < high for t in (-2 * np.pi, 0.0, 2 * np.pi))
        or low < phi[0] < phi[-1] < high
    )
    assert "makes no full turn" in found.notes[0]
    motion = closed_form.solve(*bars.lengths, phi, 1.0, mode=bars.mode)
    assert np.allclose(found["rocker_angle_rate"], motion.rocker_rate, rtol=1e-8)


def test_files(cycle, tmp_path):
    with open(cycle.save(tmp_path / "a.csv"), newline="") as file:
        head, *rows = list(csv.reader(file))
    assert head[0] == "crank_angle [rad]" and len(rows) == 73
    column = [float(r[head.index("pin_reaction [N]")]) for r in rows]
    assert column == cycle["pin_reaction"].tolist()
    svg = cycle.save(tmp_path / "a.svg").read_text()
    assert (
        svg.lstrip().startswith("<?xml")
        and "transmission angle" in svg
        and svg == cycle.save(tmp_path / "b.svg").read_text()
    )
    points = read_dxf(cycle.save(tmp_path / "a.dxf").read_text())
    assert set(points) == {"B", "C", "middle"}
    flag, middle = points["middle"]
    assert flag == 1  # closed
    assert np.array_equal(middle, np.column_stack([cycle["middle_x"], cycle["middle_z"]])[:-1])
    with pytest.raises(MechlabError, match=r"\.csv"):
        cycle.save(tmp_path / "a.xyz")


def read_dxf(text):
    """Layer -> flag and points of the polylines of a DXF text, by its pairs of code and value."""
    lines = text.splitlines()
    pairs = list(zip(lines[::2], lines[1::2], strict=True))
    out, layer, entity = {}, "", ""
    for code, value in pairs:
        if code == "0":
            entity = value
        elif code == "8":
            layer = value
        elif entity == "POLYLINE" and code == "70":
            out[layer] = (int(value), [])
        elif entity == "VERTEX" and code in ("10", "20"):
            out[layer][1].append(float(value))
    assert pairs[-1] == ("0", "EOF")
    return {n: (flag, np.array(p).reshape(-1, 2)) for n, (flag, p) in out.items()}


def test_dxf_refuses_what_is_no_curve():
    with pytest.raises(MechlabError, match="two or more finite points"):
        dxf_polylines({"a": [[0.0, np.nan], [1.0, 2.0]]})
    assert "\n70\n8\n" in dxf_polylines({"a": [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]})


def test_from_the_command_line(capsys, tmp_path):
    out = tmp_path / "c.csv"
    assert (
        main(["cycle", "fourbar", "crank=0.08", "crank_angle_rate=60rpm", "--points", "24", "-o", str(out), "--json"])
        == 0
    )
    document = json.loads(capsys.readouterr().out)
    assert document["drive"] == "crank_angle" and len(document["columns"]["crank_angle"]) == 25 and out.exists()
    assert document["columns"]["crank_angle_rate"][3] == pytest.approx(2 * np.pi)
    assert main(["cycle", "delta6"]) == 1
    assert "exactly 1" in capsys.readouterr().err
    assert main(["cycle", "fourbar", "cranc_rate=1"]) == 1
    assert "does not exist" in capsys.readouterr().err


def test_slider_crank_by_pinocchio_and_mujoco():
    from tests.engines.own.test_one_freedom import slider_crank

    found = run_cycle(slider_crank(spring=False), motion={"crank_rate": 20.0})
    (gap,) = found.witnesses.values()
    # Forces of some hundred newtons.
    assert gap < 1e-8
    x = 0.1 * np.cos(found["crank"]) + np.sqrt(0.09 - 0.01 * np.sin(found["crank"]) ** 2)
    assert np.allclose(found["slide"] - found["slide"][0], x - x[0], atol=1e-12)


def test_the_public_function():
    assert api.cycle("fourbar", crank_angle_rate=2.0, points=6)["crank_angle_rate"][0] == pytest.approx(2.0)


def test_a_pin_that_only_guides_has_no_transmission_angle() -> None:
    """Stephenson's six-bar with the load on the second dyad: no load passes the rocker of the four-bar, whose pin moves across its
    force; at the other pin the angle is that between rod and lever."""
    b = ml.Builder("sixbar")
    b.bar("crank", ml.revolute("crank_angle"), 0.08)
    b.plate("coupler", ml.revolute("coupler_joint"), [(0.25, 0), (0.12, 0.1)], parent="crank", at=(0.08, 0, 0))
    b.bar("rocker", ml.revolute("rocker_angle"), 0.2, at=(0.28, 0, 0))
    b.bar("rod", ml.revolute("rod_joint"), 0.4, parent="coupler", at=(0.12, 0.1, 0))
    b.bar("lever", ml.revolute("lever_angle"), 0.35, at=(0.5, 0.1, 0))
    b.loop("pin", "coupler", "rocker", at_a=(0.25, 0, 0), at_b=(0.2, 0, 0))
    b.loop("pin2", "rod", "lever", at_a=(0.4, 0, 0), at_b=(0.35, 0, 0))
    b.drive("crank_angle", stiffness=50)
    guess = {"crank_angle": 1.0, "coupler_joint": -0.6, "rocker_angle": 1.6, "rod_joint": 0.0, "lever_angle": 1.6}
    columns = ml.cycle(b.assemble(guess, hold=["crank_angle"]), output="lever_angle").columns
    assert np.all(np.isnan(columns["pin_transmission_angle"]))
    rod = columns["crank_angle"] + columns["coupler_joint"] + columns["rod_joint"]
    between = np.arcsin(np.abs(np.sin(columns["lever_angle"] - rod)))
    np.testing.assert_allclose(columns["pin2_transmission_angle"], between, atol=1e-8)  # the loads of a solve of 6 rows
