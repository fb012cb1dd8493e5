"""The whole pipeline of one design: files, checks, a run of the default scene, a page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.files import whole_folder
from mechlab.formats import save_recording
from mechlab.lab.design import Design
from mechlab.lab.generate import write_verified
from mechlab.lab.results import RunResult, SimulateResult
from mechlab.lab.run import run_scene
from mechlab.studies.check.check import run_checks

PagePrinter = Callable[[Design, SimulateResult, Path], Path]


def pipeline(
    design: Design, out: Path, page: PagePrinter, progress: Callable[[str], None], fidelity: str | None = None
) -> RunResult:
    """Generate, check, simulate, view; `page(design, simulation, path)` writes the page. Prints a line before each stage.

    The folder gets everything or, when a stage raises, nothing.
    """
    out = Path(out)
    level = fidelity or _richest(design)
    with whole_folder(out) as stage:
        progress(f"files of fidelity {level}")
        made = write_verified(design.mechanism(level), stage, design.file_settings)
        files = dict(made.files)
        progress("checks, each with its witnesses")
        checks = run_checks([design])
        progress(f"simulation of scene {design.default_scene}")
        simulation = SimulateResult(run_scene(design))
        files["recording"] = save_recording(simulation.recording, stage / "run.npz")
        progress("page")
        files["page"] = page(design, simulation, stage / f"{design.name}.html")
    placed = {kind: out / path.relative_to(stage) for kind, path in files.items()}
    return RunResult(out, placed, checks, simulation, (*design.warnings, *made.trial.warnings), made.trial.exit_code)


def _richest(design: Design) -> str:
    levels = [f for f in design.entry.fidelities if f != "kinematic"]
    if not levels:
        raise MechlabError(f"{design.name}: it has no fidelity with files.")
    return levels[-1]
