"""The whole pipeline of one design: files, checks, a run of the default scene, a page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.formats import save_recording
from mechlab.study.check import run_checks
from mechlab.study.design import Design
from mechlab.study.files import write_verified
from mechlab.study.results import RunResult, SimulateResult
from mechlab.study.run import run_scene

PagePrinter = Callable[[Design, SimulateResult, Path], Path]


def pipeline(
    design: Design, out: Path, page: PagePrinter, progress: Callable[[str], None], fidelity: str | None = None
) -> RunResult:
    """Generate, check, simulate, view; `page(design, simulation, path)` writes the page. Prints a line before each stage."""
    out = Path(out)
    level = fidelity or _richest(design)
    progress(f"files of fidelity {level}")
    files = dict(write_verified(design.mechanism(level), out, design.file_settings))
    progress("checks, each with its witnesses")
    checks = run_checks([design])
    progress(f"simulation of scene {design.default_scene}")
    simulation = SimulateResult(run_scene(design))
    files["recording"] = save_recording(simulation.recording, out / "run.npz")
    progress("page")
    files["page"] = page(design, simulation, out / f"{design.name}.html")
    return RunResult(out, files, checks, simulation, design.warnings)


def _richest(design: Design) -> str:
    levels = [f for f in design.entry.fidelities if f != "kinematic"]
    if not levels:
        raise MechlabError(f"{design.name}: it has no fidelity with files.")
    return levels[-1]
