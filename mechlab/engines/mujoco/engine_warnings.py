"""What MuJoCo warned of in a run, as findings; and its words when it gives up."""

from __future__ import annotations

import mujoco

from mechlab.experiment.recording import Finding

MEANINGS = {
    "BADQPOS": "the state was not finite",
    "BADQVEL": "a rate was not finite or too large",
    "BADQACC": "an acceleration was not finite or too large",
    "BADCTRL": "a control was not finite",
    "INERTIA": "the mass matrix was nearly singular",
    "CONTACTFULL": "the memory for contacts was full: some were left out",
    "CNSTRFULL": "the memory for constraints was full: some were left out",
}
HARMLESS = ("VGEOMFULL",)
"""Warnings that concern a picture; all others say that an equation was not solved as it stands."""


def engine_warnings(data: mujoco.MjData) -> list[Finding]:
    """One finding for each kind of warning that the engine counted, or one that says there were none."""
    out = []
    for k in range(mujoco.mjtWarning.mjNWARNING):
        number = int(data.warning[k].number)
        if number:
            name = mujoco.mjtWarning(k).name.removeprefix("mjWARN_")
            severity = "warning" if name in HARMLESS else "error"
            meaning = f", {MEANINGS[name]}" if name in MEANINGS else ""
            text = f"MuJoCo warned {number} times: {name}{meaning} (last at {data.warning[k].lastinfo})"
            out.append(Finding("engine_warnings", float(number), 0.0, "warnings", severity, text))
    return out or [Finding("engine_warnings", 0.0, 0.0, "warnings", "ok", "no warnings of the engine")]


def words_of(error: Exception) -> str:
    """The engine's words in one line, without the list of its limits and the last full stop."""
    return " ".join(str(error).split()).split(" max =")[0].rstrip("., ")
