"""The whole pipeline of one design: files, checks, a run of the default scene, a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording
from mechlab.files import whole_folder
from mechlab.formats import save_recording
from mechlab.lab.design import Design
from mechlab.lab.generate import write_verified
from mechlab.lab.run import run_scene
from mechlab.lazy_dataclass import dataclass
from mechlab.results import Shown, line_of, text_of
from mechlab.studies.check.check import CheckReport, run_checks
from mechlab.tables import table

PagePrinter = Callable[[Design, Recording, Path], Path]


@dataclass(frozen=True, repr=False)
class RunResult(Shown):
    """The result of the pipeline: files by kind, checks, the run of the default scene, exit code and fidelity of the model files."""

    folder: Path
    files: Mapping[str, Path]
    checks: CheckReport
    simulation: Recording
    warnings: tuple[str, ...] = ()
    files_code: int = 0
    fidelity: str = ""

    @property
    def exit_code(self) -> int:
        """3 when a check failed, the run must not be trusted, or the model file does not run in plain MuJoCo."""
        return max(self.checks.exit_code, self.simulation.exit_code, self.files_code)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        message = "; ".join([self.checks.message, self.simulation.message])
        return {
            "folder": str(self.folder), "files": {k: str(v) for k, v in self.files.items()}, "checks": self.checks.to_dict()["checks"],
            "simulation": self.simulation.to_dict(), "message": message, "warnings": list(self.warnings),
        }  # fmt: skip


@line_of.register
def _(result: RunResult) -> str:
    return f"Run of {result.simulation.name} into {result.folder}: {result.checks.message}; {result.simulation.message}"


@text_of.register
def _(result: RunResult) -> str:
    """The table of checks, the health of the run, the table of files."""
    run = result.simulation
    lines = [result.checks.text(), "", f"run of scene {run.scene}, fidelity {run.fidelity}; what acts: {run.acts}"]
    if result.fidelity not in ("", run.fidelity):
        command = f"mechlab view {run.name} --fidelity {result.fidelity}"
        lines.append(f"the model files are of fidelity {result.fidelity}; to run and see that: {command}")
    lines += [f"  {f.severity:8s}{f.sentence}" for f in run.health.findings]
    lines += ["", table(["what", "where"], [[kind, str(path)] for kind, path in result.files.items()])]
    return "\n".join([*lines, *(f"warning: {w}" for w in result.warnings)])


def pipeline(
    design: Design, out: Path, page: PagePrinter, progress: Callable[[str], None], fidelity: str | None = None
) -> RunResult:
    """Generate, check, simulate, view; `page(design, recording, path)` writes the page. Calls `progress` before each
    stage.

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
        progress(f"simulation of scene {design.scene_for()}")
        recording = run_scene(design)
        files["recording"] = save_recording(recording, stage / "run.npz")
        progress("page")
        files["page"] = page(design, recording, stage / f"{design.name}.html")
    placed = {kind: out / path.relative_to(stage) for kind, path in files.items()}
    return RunResult(out, placed, checks, recording, (*design.warnings, *made.trial.warnings), made.trial.exit_code, level)


def _richest(design: Design) -> str:
    levels = [f for f in design.entry.fidelities if f != "kinematic"]
    if not levels:
        raise MechlabError(f"{design.name}: it has no fidelity with files.")
    return levels[-1]
