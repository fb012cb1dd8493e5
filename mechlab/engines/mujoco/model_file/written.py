"""A short run of a model file in plain MuJoCo, and settings with which the file completes it.

A file may be loaded by MuJoCo and still blow up in its first steps: a servo that is too stiff for the timestep. So the text
that is to be written is stepped as anybody would step it: from its keyframe, and from there with a push along all free
motions. Where the settings asked for fail, smaller timesteps and the integrator `discrete`, implicit in springs, dampers and
servos, are tried in turn.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import compiling, engine
from mechlab.engines.mujoco.model_file.options import growing_step
from mechlab.engines.mujoco.model_file.rows import PUSH, Start, free_push, started
from mechlab.engines.mujoco.model_file.start import start_data
from mechlab.engines.mujoco.model_file.trace import at_timestep
from mechlab.engines.mujoco.sparse import sparse_is_right, sparse_steps
from mechlab.engines.mujoco.trace import step_through
from mechlab.experiment.recording import Symptom
from mechlab.experiment.scene import MUJOCO_INTEGRATORS, Settings
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism

DURATION, MOST_STEPS, OUTPUTS = 1.0, 8000, 20
"""A run lasts DURATION [s], or MOST_STEPS steps if that is less."""
WILD, FALL = 10.0, (2.0 / PUSH) ** 0.5
"""Rates more than WILD times those at half the timestep come from the step, not from the mechanism. Only rates above
FALL times those of the push count: FALL corresponds to the kinetic energy of a fall through the size of the model."""
SMALLER = (2, 4, 8, 16)
"""Divisors of the timestep that are tried with the integrator asked for."""
IMPLICIT = (4, 16, 64)
"""Divisors of the timestep tried next with `discrete`, which is of first order: hence not at the full timestep."""


@dataclass(frozen=True)
class FileTrial:
    """settings: those with which the file runs, or those asked for where none were found; trouble: what happens with those
    asked for ("" when the file runs with them); paste: what may help where no settings were found."""

    asked: Settings
    settings: Settings
    trouble: str = ""
    paste: str = ""

    @property
    def exit_code(self) -> int:
        """3 when the file must not be run as it is."""
        return 3 if self.trouble and self.settings == self.asked else 0

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was changed and why, or that nothing helped and what to do."""
        if not self.trouble:
            return ()
        if self.exit_code:
            return (
                f"do not run the file as it is: {self.trouble} No timestep down to {_spread(self.asked):.2g} s and no integrator "
                f"that was tried carries it. {self.paste}",
            )
        s = self.settings
        return (
            f'the file says timestep="{s.timestep:.6g}" integrator="{s.integrator}" instead of "{self.asked.timestep:.6g}" and '
            f'"{_integrator(self.asked)}", with which it does not run in plain MuJoCo: {self.trouble}',
        )


def try_file(m: Mechanism, settings: Settings | None = None) -> FileTrial:
    """Make a short run of the MJCF of a mechanism and find settings with which it completes that run."""
    asked = settings or Settings()
    found = _trouble(m, asked)
    if found is None:
        return FileTrial(asked, asked)
    for other in _others(asked):
        if _trouble(m, other) is None:
            return FileTrial(asked, other, found.sentence)
    paste = f"Paste {found.paste} into it." if found.paste else "Make its springs, dampers and servos softer."
    return FileTrial(asked, asked, found.sentence, paste)


def _others(asked: Settings) -> Iterator[Settings]:
    h = asked.timestep
    yield from (replace(asked, timestep=h / n) for n in SMALLER)
    if _integrator(asked) != "discrete":
        yield from (replace(asked, engine="mujoco", integrator="discrete", timestep=h / n) for n in IMPLICIT)


def _spread(asked: Settings) -> float:
    """The smallest timestep that is tried."""
    return min(s.timestep for s in _others(asked))


def _integrator(s: Settings) -> str:
    """The integrator as `to_mjcf` writes it."""
    return s.integrator if s.integrator in MUJOCO_INTEGRATORS else "RK4"


def _trouble(m: Mechanism, settings: Settings) -> Symptom | None:
    """What goes wrong with the file that these settings make; None when it runs. None too when MuJoCo refuses the
    model: the reload of the written file reports that with the file's name."""
    try:
        with compiling():
            model = mujoco.MjModel.from_xml_string(to_mjcf(m, settings))
    except ValueError:
        return None
    return run_trouble(model)


def run_trouble(model: mujoco.MjModel) -> Symptom | None:
    """What goes wrong in a short run of a model with a keyframe, as it is: a linear instability of the step at the
    start, a run that diverges, rates that only the step makes. None when it runs.

    The bound on the work is a count of steps: MOST_STEPS at the timestep and twice as many at half of it, from two starts.
    """
    if not model.nv:
        return None
    with engine():
        data = start_data(model)
        home, ctrl = np.array(data.qpos), np.array(data.ctrl)
        mujoco.mj_forward(model, data)
        push = free_push(model, home, max(float(model.stat.extent), 1e-9))
        unstable = next(growing_step(model, home), None)
        if unstable is not None:
            return unstable
        usual = FALL * float(np.max(np.abs(push), initial=0.0))
        for start in ((home, np.zeros(model.nv), ctrl), (home, push, ctrl)):
            fastest, reason = _run(model, start, 1)
            if reason:
                return Symptom("trial", "error", f"a run of it {reason}.")
            half, failed = _run(model, start, 2) if fastest > usual else (fastest, "")
            if not failed and fastest > WILD * half:
                text = f"a run of it reaches {fastest:.3g} rad/s or m/s, with half the timestep {half:.3g}."
                return Symptom("trial", "error", text)
    return None


def _run(model: mujoco.MjModel, start: Start, parts: int) -> tuple[float, str]:
    """The largest rate of a run with the timestep divided by `parts`, and why it ended early."""
    each = max(1, min(MOST_STEPS, round(DURATION / model.opt.timestep)) // OUTPUTS)
    model = at_timestep(model, model.opt.timestep / parts)
    data = started(model, start)
    with sparse_steps(model, sparse_is_right(model, data)):
        _, rates, _, reason = step_through(model, data, OUTPUTS, parts * each)
    return float(np.max(np.abs(rates), initial=0.0)), reason
