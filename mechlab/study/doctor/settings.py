"""The settings to paste: `<option>` and the default class of equalities, from what was found."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco

from mechlab.study.doctor.result import Symptom
from mechlab.study.doctor.softness import active, equality_default
from mechlab.study.doctor.trial import Trial

IN_URDF = (
    '<mujoco><compiler discardvisual="false"/><option integrator="RK4" timestep="0.001" jacobian="dense"/></mujoco>'
)
"""For a URDF that is to be opened in MuJoCo: a child of <robot>."""


def settings_to_paste(model: mujoco.MjModel, trial: Trial | None, findings: Iterable[Symptom]) -> str:
    """The text; a comment says what else must go. The integrator is the one that came through in the trial."""
    h = float(model.opt.timestep)
    better = trial.better if trial is not None and trial.better else "discrete"
    if any(f.name == "unstable_step" for f in findings):
        better = "discrete"
    lines = [
        f'<option timestep="{h:g}" integrator="{better}" jacobian="dense">',
        '  <flag autoreset="disable"/>',
        "</option>",
    ]
    if active(model):
        lines.append(equality_default(h))
        lines.append("<!-- an equality with a solref or solimp of its own keeps it: delete those attributes -->")
    return "\n".join(lines)
