"""No more model than the scene needs: choices, and that the errors which are stated are true."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechlab as ml
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.experiment.entry import Entry, SceneRecipe
from mechlab.experiment.parameters import parameter
from mechlab.experiment.scene import Scene, Settings
from mechlab.lab.fidelity.choose import choose, chosen_scene, missing_answers
from mechlab.lab.fidelity.measure import agreement
from mechlab.lab.run import run_scene
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute
from mechlab.studies.fidelity.compare import compare


@pytest.mark.parametrize(
    ("name", "needs", "expected"),
    [
        ("closed_differential", ("poses", "drive_forces"), "minimal"),
        ("closed_differential", ("poses", "tooth_loads"), "parts"),
        ("closed_differential", ("reactions",), "full"),
        ("impulse_transmission", ("poses", "drive_forces"), "minimal"),
        ("impulse_transmission", ("tooth_loads",), "full"),
        ("gear_linkage", ("poses", "tooth_loads", "reactions"), "minimal"),
        ("fourbar", ("poses",), "minimal"),
        ("delta6", ("reactions",), "full"),
    ],
)
def test_the_cheapest_that_answers_is_taken(name: str, needs: tuple[str, ...], expected: str) -> None:
    found = choose(ml.load(name), needs=needs)
    assert found.chosen == expected and expected in found.sentence
    assert all(need.replace("_", " ") in found.sentence for need in needs)


@pytest.mark.slow
def test_the_delta_is_minimal_for_poses_and_parts_for_teeth() -> None:
    assert choose(ml.load("delta6"), needs=("poses", "drive_forces")).chosen == "minimal"
    found = choose(ml.load("delta6"), needs=("poses", "tooth_loads"))
    assert found.chosen == "parts" and "minimal cannot give tooth loads" in found.sentence


def test_what_no_fidelity_has_is_refused() -> None:
    with pytest.raises(MechlabError, match="no fidelity answers tooth_loads"):
        choose(ml.load("fourbar"), needs=("tooth_loads",))
    with pytest.raises(MechlabError, match="need 'teeth' does not exist"):
        choose(ml.load("fourbar"), needs=("teeth",))


def test_exactness_is_checked_and_not_believed() -> None:
    """The gear train reduces exactly; with the inertia of one part changed the same check finds it."""
    d = ml.load("closed_differential")
    small, rich = d.mechanism("minimal"), d.mechanism("full")
    scenes = d.scene(None, "minimal"), d.scene(None, "full")
    assert agreement(small, rich, *scenes).exact
    heavier = replace(small, shafts=tuple(replace(s, inertia=1.001 * s.inertia) for s in small.shafts))
    found = agreement(heavier, rich, *scenes)
    assert not found.exact and 1e-5 < found.difference < 1e-2
    delta = ml.load("delta6")
    found = agreement(
        delta.mechanism("minimal"), delta.mechanism("full"), delta.scene(None, "minimal"), delta.scene(None, "full")
    )
    assert not found.exact  # the drawing of the rods as one slender body is an approximation, and it is found


@dataclass(frozen=True)
class BarParameters:
    length: float = parameter(1.0, "m", "a uniform bar")
    tolerance: float = parameter(1e-3, "rad", "tolerance of the scene")


def bar(p: BarParameters, fidelity: str) -> Mechanism:
    """`full`: a bar; `minimal`: its mass in its centre, which swings too fast by sqrt(4/3)."""
    b = Builder("bar")
    inertia = Inertia.point(1.0, (0.5 * p.length, 0.0, 0.0))
    if fidelity == "full":
        inertia = Inertia.rod(1.0, (0.0, 0.0, 0.0), (p.length, 0.0, 0.0))
    return b.body("bar", revolute("angle", "y"), inertia=inertia).build()


def falling(p: BarParameters, fidelity: str) -> Scene:
    return Scene("fall", fidelity, 0.5, tolerance=p.tolerance)


BAR = Entry(
    name="bar", title="Bar", summary="", parameters=BarParameters, build=bar,
    fidelities={"minimal": "a point", "full": "a bar"}, default_fidelity="full",
    scenes={"fall": SceneRecipe(falling, "auto", "let go from the horizontal")}, default_scene="fall",
)  # fmt: skip


def test_the_error_that_is_stated_is_true() -> None:
    """Against both equations of motion, integrated here."""
    ends = []
    for inertia in (0.25, 1.0 / 3.0):

        def slope(t: float, y: np.ndarray, inertia: float = inertia) -> list[float]:
            return [y[1], 0.5 * 9.81 * np.cos(y[0]) / inertia]

        fall = solve_ivp(slope, (0.0, 0.5), [0.0, 0.0], rtol=1e-10, atol=1e-12)
        ends.append(fall.y[0, -1])
    table = compare(ml.load(BAR))
    # the difference grows with time; RK4 of the engine at 1 ms is good to 1e-9
    assert table.level("minimal").error == pytest.approx(abs(ends[0] - ends[1]), rel=1e-6)
    assert table.level("minimal").resolution == 0.0 and table.level("full").error == 0.0
    assert table.chosen == "full" and "too far" not in table.level("full").status
    assert compare(ml.load(BAR, tolerance=1.0)).chosen == "minimal"


def test_auto_follows_the_tolerance_of_the_scene() -> None:
    strict, loose = ml.simulate(ml.load(BAR)), ml.simulate(ml.load(BAR, tolerance=1.0))
    assert (strict.fidelity, loose.fidelity) == ("full", "minimal")
    assert "minimal is too far off (angle by" in strict.health.finding("fidelity").sentence
    assert "tolerance 1" in loose.health.finding("fidelity").sentence


@pytest.mark.slow
def test_the_error_of_the_delta_is_true_as_far_as_the_engine_can_tell() -> None:
    """Against rigid dynamics on Pinocchio, where no row gives way."""
    span, d = 0.03, ml.load("delta6")
    row = compare(d, duration=span).level("parts")
    rigid = Settings(engine="pinocchio", integrator="RK4", timestep=1e-3)
    times = tuple(np.linspace(0.0, span, 16))
    parts, full = (
        run_scene(d, duration=span, fidelity=f, settings=rigid, at=times, estimate=False) for f in ("parts", "full")
    )
    names = [n for n in parts.mechanism.scalar_names if n in full.mechanism.scalar_names]
    off = max(float(np.max(np.abs(parts.channel(n) - full.channel(n)))) for n in names)
    assert row.resolution is not None and 0.0 < row.resolution < 1e-4 and row.rows == 12
    assert row.error == pytest.approx(off, abs=row.resolution)


def test_an_exact_reduction_runs_the_same_motion() -> None:
    table = compare(ml.load("closed_differential"), duration=0.1)
    assert table.chosen == "minimal"
    # exact on paper; MuJoCo's gear rows of the richest are soft: 1e-6 rad
    assert (table.level("minimal").error or 0.0) < 1e-5 and "exact reduction" in table.level("minimal").exact
    document = table.to_dict()
    assert {"fidelities", "chosen", "sentence"} <= set(document)
    assert {"fidelity", "freedoms", "coordinates", "rows", "answers", "error", "cost", "status"} <= set(
        document["fidelities"][1]
    )
    assert document["fidelities"][0]["status"].startswith("closed form only")


def test_rows_tell_what_can_be_read() -> None:
    d = ml.load("delta6")
    full = d.mechanism("full")
    assert missing_answers(full, full) == {}
    assert set(missing_answers(d.mechanism("parts"), full)) == {"reactions"}
    assert set(missing_answers(d.mechanism("minimal"), full)) == {"tooth_loads", "reactions"}


def test_auto_runs_what_it_chose_and_says_why() -> None:
    run = ml.simulate("closed_differential", fidelity="auto", duration=0.02)
    assert run.fidelity == "minimal"
    finding = run.health.finding("fidelity")
    assert "exact reduction of full" in finding.sentence and finding.severity == "ok"
    same = ml.simulate("closed_differential", fidelity="minimal", duration=0.02)
    np.testing.assert_array_equal(run.q, same.q)


def test_a_scene_may_leave_the_fidelity_open() -> None:
    d = ml.load("closed_differential")
    entry = replace(d.entry, scenes={n: replace(r, fidelity="auto") for n, r in d.entry.scenes.items()})
    open_design = replace(d, entry=entry)
    assert chosen_scene(open_design).fidelity == "minimal"
    with pytest.raises(MechlabError, match="choose first"):
        open_design.scene()
    assert ml.simulate(open_design, duration=0.02).health.finding("fidelity").sentence.startswith("fidelity minimal")


def test_the_table_is_drawn_and_the_command_line_answers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["chart", "closed_differential", "--fidelities", "--duration", "0.02", "--needs", "tooth_loads"]
    assert main([*arguments, "-o", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "fidelity parts answers tooth loads" in out and "side by side" in out
    assert (tmp_path / "fidelities_closed_differential.png").read_bytes()[:4] == b"\x89PNG"
    assert main(["chart", "fourbar", "--needs", "poses"]) == 2
    assert main(["modes", "pendulum", "--mode", "1"]) == 2
    assert main(["modes", "pendulum", "--json"]) == 0 and '"kind": "oscillating"' in capsys.readouterr().out
