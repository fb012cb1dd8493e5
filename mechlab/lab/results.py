"""Results of the verbs: each has an exit code, a JSON-able form and a text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.experiment.question import Answers
from mechlab.experiment.recording import Recording
from mechlab.tables import Told, html_table, number, table


@dataclass(frozen=True)
class SolveResult:
    """Answers of all witnesses."""

    answers: Answers

    @property
    def exit_code(self) -> int:
        """0 answered, 3 not to be trusted, 4 no solution."""
        return self.answers.exit_code

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        a = self.answers
        status = a.status.value
        out: dict[str, Any] = {
            "question": a.question, "answers": {n: x.to_dict() for n, x in a.answers.items()}, "max_difference": a.max_difference,
            "status": status, "open": [x.to_dict() for x in a.open], "idle": list(a.idle), "assumed": a.assumed,
            "parameters": dict(a.parameters), "given": dict(a.given), "warnings": list(a.warnings),
        }  # fmt: skip
        notes = [f"{n}: {t}" for n, x in a.answers.items() for t in x.notes]
        notes += a.remarks
        out["message"] = status + (f" ({'; '.join(notes)})" if notes else "")
        return out

    def text(self) -> str:
        """A table with a column for each witness."""
        from mechlab.lab.ask import answers_text

        return answers_text(self.answers)

    def _repr_html_(self) -> str:
        return self.answers._repr_html_()


ROUNDING = 1e-9
"""Of the range of a channel: what a table shows as 0, where the error is not smaller."""


@dataclass(frozen=True)
class SimulateResult:
    """A recording, sampled."""

    recording: Recording
    at: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def exit_code(self) -> int:
        """0, or 3 when the run must not be trusted."""
        return self.recording.health.exit_code

    @property
    def message(self) -> str:
        """What makes the run doubtful, in words."""
        bad = [f.sentence for f in self.recording.health.findings if f.severity == "error"]
        return "; ".join(bad) if bad else "finished"

    def samples(self) -> list[dict[str, float]]:
        """Channels at the asked times (the last recorded time when a run ended early is not exceeded)."""
        r = self.recording
        inside = [t for t in self.at if t <= r.t[-1] * (1 + 1e-12)]
        return [{"t": t} | {name: r.at(name, t) for name in r.channels} for t in inside]

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        r = self.recording
        return {
            "scene": r.scene, "acts": r.acts, "fidelity": r.fidelity,
            "engine": r.settings.engine, "integrator": r.settings.integrator,
            "timestep": r.settings.timestep, "duration": float(r.t[-1]), "final": r.final(), "samples": self.samples(),
            "units": dict(r.units), "errors": dict(r.errors),
            "health": [f.to_dict() for f in r.health.findings], "parameters": dict(r.parameters),
            "cost": {"cpu_s": r.cost.cpu_s, "steps": r.cost.steps, "evaluations": r.cost.evaluations}, "message": self.message,
            "status": "finished" if r.health.trusted else "finished, do not trust it", "notes": list(self.notes),
        }  # fmt: skip

    def text(self) -> str:
        """Final values, samples, health, cost."""
        r = self.recording
        times = [*self.at, float(r.t[-1])]
        names = list(r.channels)
        noise = {n: self._noise(n) for n in names}
        columns = [{n: s[n] if abs(s[n]) > noise[n] else 0.0 for n in names} for s in [*self.samples(), r.final()]]
        heads = ["channel", "unit", *(f"t = {t:g} s" for t in times[: len(columns) - 1]), f"t = {r.t[-1]:g} s (end)"]
        rows = [[n, r.units.get(n, ""), *(number(c[n], 7) for c in columns)] for n in names]
        if r.errors:
            heads.append("error, at most")
            rows = [[*row, number(r.errors.get(row[0]), 2)] for row in rows]
        lines = [
            f"{r.name}, scene {r.scene}, fidelity {r.fidelity}, "
            f"engine {r.settings.engine} ({r.settings.integrator}, {r.settings.timestep:g} s)"
        ]
        if r.acts:
            lines.append(f"what acts: {r.acts}")
        lines += [table(heads, rows), "", "health"]
        lines += [f"  {f.severity:8s}{f.sentence}" for f in r.health.findings]
        lines += [f"  note    {n}" for n in self.notes]
        lines.append(f"cost: {r.cost.steps} steps, {r.cost.evaluations} evaluations, {r.cost.cpu_s:.3g} s of CPU")
        return "\n".join(lines)

    def _noise(self, channel: str) -> float:
        """Size up to which the table shows a value as 0: below its error, and below ROUNDING of the range of the channel."""
        values = self.recording.channels[channel]
        finite = np.abs(values[np.isfinite(values)])
        return min(ROUNDING * float(np.max(finite, initial=0.0)), self.recording.errors.get(channel, 0.0))

    def _repr_html_(self) -> str:
        return self.recording._repr_html_()

    def save(self, path: Path) -> Path:
        """Write the recording as .npz."""
        from mechlab.formats import save_recording

        return save_recording(self.recording, path)

    def __getitem__(self, channel: str) -> np.ndarray:
        return self.recording.channel(channel)


@dataclass(frozen=True)
class FilesResult(Told):
    """Files that were written."""

    folder: Path
    files: Mapping[str, Path]
    sentence: str = ""
    warnings: tuple[str, ...] = ()
    exit_code: int = 0

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "folder": str(self.folder),
            "files": {k: str(v) for k, v in self.files.items()},
            "message": self.sentence,
            "warnings": list(self.warnings),
        }

    def text(self) -> str:
        """Where the files are."""
        rows = [[k, str(v)] for k, v in self.files.items()]
        return "\n".join(
            [
                table(["what", "file"], rows),
                *([self.sentence] if self.sentence else []),
                *(f"warning: {w}" for w in self.warnings),
            ]
        )


@dataclass(frozen=True)
class TableResult:
    """A table with its data."""

    headers: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    data: Mapping[str, Any] = field(default_factory=dict)
    exit_code: int = 0

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return dict(self.data)

    def text(self) -> str:
        """The table."""
        return table(self.headers, self.rows)

    def _repr_html_(self) -> str:
        return html_table(self.headers, self.rows)


@dataclass(frozen=True)
class RunResult(Told):
    """The whole pipeline: files, checks, recording, page."""

    folder: Path
    files: Mapping[str, Path]
    checks: Any
    simulation: SimulateResult
    warnings: tuple[str, ...] = ()
    files_code: int = 0

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

    def text(self) -> str:
        """Check table, health, where everything is."""
        rows = [[k, str(v)] for k, v in self.files.items()]
        health = [f"  {f.severity:8s}{f.sentence}" for f in self.simulation.recording.health.findings]
        parts = [
            self.checks.text(),
            "",
            f"run of scene {self.simulation.recording.scene}; what acts: {self.simulation.recording.acts}",
            *health,
            "",
            table(["what", "where"], rows),
        ]
        return "\n".join([*parts, *(f"warning: {w}" for w in self.warnings)])
