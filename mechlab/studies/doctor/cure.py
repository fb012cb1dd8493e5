"""A cured copy of an MJCF file: the settings that a diagnosis asks for, written into its text, and what a run of it gains."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.engines.mujoco.model_file.joints import ranges_to_command
from mechlab.engines.mujoco.model_file.parts import overlapping
from mechlab.engines.mujoco.model_file.rows import mocap_bodies
from mechlab.engines.mujoco.model_file.softness import IMPEDANCE
from mechlab.engines.mujoco.model_file.trace import integrator_name
from mechlab.engines.mujoco.model_file.trial import TrialRun
from mechlab.errors import MechlabError
from mechlab.experiment.model_file import ModelFile
from mechlab.files import write
from mechlab.formats.model_text import read_text
from mechlab.lazy_dataclass import dataclass
from mechlab.results import Shown
from mechlab.studies.doctor.case import Diagnosis, ExaminedFile, read_case
from mechlab.studies.doctor.diagnose import diagnose
from mechlab.studies.doctor.mjcf_edit import MjcfText

ROUNDS = 3
"""Diagnoses of the cured text: one cure may uncover what another finding hid (ranges in degrees hide everything)."""
HARD_LOOPS = {"soft_equalities", "softer_than_it_could_be", "sag", "refsafe", "stiff_equalities"}
INTEGRATOR = {"first_order", "trial", "pushed", "damping_across_branches"}


@dataclass(frozen=True, repr=False)
class Cure(Shown):
    """What was changed in a file, and the diagnoses of it and of the cured file at `path`."""

    name: str
    path: Path
    changes: tuple[str, ...]
    before: Diagnosis
    after: Diagnosis

    @property
    def exit_code(self) -> int:
        """That of the cured file: 3 when results of it cannot be trusted either."""
        return self.after.exit_code

    @property
    def message(self) -> str:
        """One sentence."""
        if not self.changes:
            return f"{self.name}: nothing that a change of settings cures; {self.after.message}"
        return f"{self.name}: {self.before.verdict}; after {len(self.changes)} changes, {self.path.name}: {self.after.verdict}"

    @property
    def cured(self) -> tuple[str, ...]:
        """Names of the errors and warnings that are gone."""
        left = {f.name for f in self.after.findings if f.severity != "note"}
        return tuple(f.name for f in self.before.findings if f.severity != "note" and f.name not in left)

    def gains(self) -> list[tuple[str, str, float | None, float | None]]:
        """(quantity, unit, before, after) of the runs of both files."""
        a, b = self.before.run, self.after.run
        quantities: list[tuple[str, str, Callable[[TrialRun], float]]] = [
            ("error of the motion", "m", lambda t: t.error),
            ("the same, over its extent", "", lambda t: t.share),
            ("change with half the step", "m", lambda t: t.step),
            ("largest gap of a loop", "m or rad", lambda t: t.gap),
            ("error of the energy", "J", lambda t: t.energy),
        ]
        return [(name, unit, _value(a, f), _value(b, f)) for name, unit, f in quantities]

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        gains = [{"quantity": n, "unit": u, "before": a, "after": b} for n, u, a, b in self.gains()]
        return {
            "file": self.name, "written": str(self.path), "changes": list(self.changes), "gains": gains, "cured": list(self.cured),
            "before": self.before.to_dict(), "after": self.after.to_dict(), "message": self.message,
        }  # fmt: skip


def _value(run: TrialRun | None, of: Callable[[TrialRun], float]) -> float | None:
    if run is None or run.shown.reason:
        return None
    value = float(of(run.shown))
    return value if np.isfinite(value) else None


def cure_file(path: Path, out: Path, read: Callable[[Path], ModelFile], overwrite: bool = False) -> Cure:
    """Write the cured copy of an MJCF file; raises MechlabError for other files, and where `out` is the file itself."""
    if path.suffix.lower() != ".xml":
        raise MechlabError(
            f"cannot cure {path}: only an MJCF file (.xml) has the settings that a cure changes. "
            "The loops of a URDF are closed by a YAML beside it; `mechlab generate FILE.urdf -o DIR` writes an MJCF of it."
        )
    if out.suffix.lower() != ".xml":
        raise MechlabError(f"cannot write the cured file to {out}: expected a name that ends in .xml.")
    if os.path.realpath(out) == os.path.realpath(path) and not overwrite:
        raise MechlabError(f"{out} is the file itself: give another name, or --overwrite.")
    case = read_case(path, read)
    before = after = diagnose(case)
    edited = MjcfText(read_text(path))
    moved = edited.move(path.parent, out.parent)
    changes: list[str] = []
    trial = out.with_name(f".{out.stem}.cure.xml")
    try:
        for _ in range(ROUNDS):
            done = [x for x in _treated(edited, case, after) if x]
            if not done:
                break
            changes += [x for x in done if x not in changes]
            write(trial, edited.text())
            try:
                case = read_case(trial, read)
            except MechlabError as error:
                if moved:
                    text = f"what {path} includes is not read from {out.parent}: write the cured file beside it. {error}"
                    raise MechlabError(text) from None
                raise
            after = diagnose(case)
    finally:
        trial.unlink(missing_ok=True)
    write(out, edited.text())
    after = diagnose(read_case(out, read))
    return Cure(path.name, out, tuple(changes), before, after)


def _treated(text: MjcfText, case: ExaminedFile, diagnosis: Diagnosis) -> list[str]:
    """The changes for the errors and warnings of a diagnosis."""
    model = case.model
    if model is None:
        return []
    found = {f.name: f for f in diagnosis.findings if f.severity != "note"}
    if "degrees" in found:  # before anything else: every range and every run hangs on it
        return [text.setting("compiler", angle="degree" if '"degree"' in found["degrees"].paste else "radian")]
    done = []
    timestep = float(model.opt.timestep)
    if HARD_LOOPS & found.keys() and diagnosis.loops:
        done.append(text.harden(f"{2 * timestep:g} 1", IMPEDANCE, mocap_bodies(model)))
    if "contacts" in found:
        done.append(text.exclude(overlapping(model)))
    if "control_beyond_range" in found:
        done.append(text.actuators(ranges_to_command(model)))
    if "fast_activation" in found:
        done.append(text.exact_filters())
    if "memory" in found:
        done.append(text.setting("size", memory=found["memory"].paste.split('"')[1]))
    if "sparse_jacobian" in found:
        done.append(text.setting("option", jacobian="dense"))
    if "unstable_step" in found:
        done.append(text.setting("option", integrator="discrete"))
    elif INTEGRATOR & found.keys() and (asked := _integrator(diagnosis.paste)) not in ("", integrator_name(model)):
        done.append(text.setting("option", integrator=asked))
    return done


def _integrator(paste: str) -> str:
    """The integrator of the settings to paste, "" for none."""
    return paste.partition('integrator="')[2].partition('"')[0]
