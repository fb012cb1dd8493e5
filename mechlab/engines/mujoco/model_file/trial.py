"""A short run of the file as it is, compared with one that has hard loops, small steps and the better integrator.

The difference is how far off the motion is, which the file itself does not show. The run starts from the first keyframe, or the
reference pose, and is not pushed. Only where the loops of a file do not move in it, a second run is made with a push along their
free motions, and what it shows is said to be under that push.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.file_run import OUTPUTS, moving_size, prepared, price, run_file
from mechlab.engines.mujoco.model_file.rows import free_push, loops
from mechlab.engines.mujoco.model_file.start import start_pose
from mechlab.engines.mujoco.model_file.trace import FILE_STEPS, FileTrace, file_order
from mechlab.experiment.recording import Finding, Symptom
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

DURATION, MOST_STEPS = 0.5, 500
"""The run lasts DURATION [s], or MOST_STEPS of the file's steps if that is less."""
BUDGET = 4.0
"""Counted work of all runs together [s]; a file whose steps cost more is run for a shorter time."""
REFERENCE = 2 + 4 * (4 + 2)
"""Work of the runs that are compared, in runs of the file: at half its timestep, and of RK4 at a quarter and a half."""
WRONG, DOUBTFUL = 1e-2, 1e-3
"""Error over the extent of the motion of a file with loops: an error of the file above WRONG, a warning above DOUBTFUL."""
COARSE, ROUGH = 0.1, 1e-2
"""The same for a tree without contact, whose error comes from the step alone."""
APART = 0.05
"""With contacts, limits or dry friction the paths depend on the step: over the size of the model, from here on a warning."""
SLIGHT = 1e-2
"""Gap of a loop in a run with contacts, over the size of the model, that matters little."""
WILD, FAST = 10.0, 10.0
"""Rates more than WILD times those of the finer run, and than FAST [rad/s or m/s], come from the step, not from the mechanism."""
STILL = 1e-2
"""Motion, over the size of the model, below which a run says nothing."""
SURE = 3.0
"""The finer run is a reference only where its own error is smaller by this factor than the difference to it."""
MORE_MEMORY = 4
"""Memory to ask for where it was full, in sizes of what the file has: what did not fit is not counted."""
SEEN = 1e-6
"""Change of a run, over the size of the model, from which on its order of convergence matters."""


@dataclass(frozen=True)
class TrialRun:
    """error [m]: of the centres of mass in a run as the file says; own [m]: error of the reference run itself; step [m]: change of
    the file's run with half its timestep; fastest, fine_fastest [rad/s or m/s]: largest rates of the two runs; energy [J]: largest
    difference of the energies; gap, fine_gap [m, rad]: largest residual of a loop in the two runs; gaps: by equality; touched: what
    acted besides the loops; duration [s]: simulated time; reason: why the run of the file ended early; better: integrator of the
    reference run, "" when none completed; moved [m]: extent of the motion; size [m] of what moves; pushed [rad/s or m/s]: largest
    rate of a push, 0 without; follow: the run with a push; rk4: whether the file asks for RK4; skipped: what was not
    examined and why; full: how often the memory for contacts and for rows was full; memory: its size [bytes]."""

    error: float
    own: float
    duration: float
    reason: str
    better: str
    moved: float
    size: float
    step: float = np.inf
    fastest: float = 0.0
    fine_fastest: float = 0.0
    energy: float = np.inf
    gap: float = 0.0
    fine_gap: float = 0.0
    gaps: dict[int, float] | None = None
    touched: frozenset[str] = frozenset()
    looped: bool = False
    rk4: bool = False
    pushed: float = 0.0
    observed: Finding | None = None
    follow: TrialRun | None = None
    skipped: str = ""
    full: tuple[int, int] = (0, 0)
    memory: int = 0

    @property
    def share(self) -> float:
        """Error of the run over the extent of its motion."""
        return self.error / max(self.moved, STILL * self.size)

    @property
    def convincing(self) -> bool:
        """Whether the reference is sure enough to tell the error."""
        return bool(self.better) and self.error >= SURE * self.own

    @property
    def convinced_small(self) -> bool:
        """Whether the run shows that the softness of the loops matters little: without contact by the error of its motion, with
        contact by the gaps of its loops."""
        if not self.better or self.reason or self.wild:
            return False
        if self.touched:
            return self.gap <= SLIGHT * self.size
        return self.moved >= STILL * self.size and max(self.error, self.own) <= DOUBTFUL * self.moved

    @property
    def wild(self) -> bool:
        """Whether the run reaches rates that only its timestep makes."""
        return bool(self.better) and self.fastest > WILD * max(self.fine_fastest, FAST)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form; None for what was not found."""
        found = {
            "duration": self.duration, "error": self.error, "known_to": self.own, "step_error": self.step, "moved": self.moved,
            "energy_error": self.energy, "gap": self.gap, "gap_of_reference": self.fine_gap,
        }  # fmt: skip
        numbers = {k: x if np.isfinite(x) else None for k, x in found.items()}
        return numbers | {"ended": self.reason, "reference": self.better, "acting": sorted(self.touched)}

    @property
    def shown(self) -> TrialRun:
        """The run that shows how the loops move: the pushed one where the file's own stands still."""
        return self.follow or self

    def symptoms(self) -> Iterator[Symptom]:
        """Finding "trial" of the file's own run, "pushed" of the run with a push."""
        yield from _symptoms(self)
        if self.follow is not None:
            yield from _symptoms(self.follow)

    def memory_full(self) -> Iterator[Symptom]:
        """Finding "memory" of the run as the file says."""
        words = [f"{n} times for {what}" for n, what in zip(self.full, ("contacts", "rows"), strict=True) if n]
        if words:
            text = (
                f"in a run of {self.duration:.3g} s as the file says, MuJoCo's memory of {self.memory / 2**20:.3g} MiB was full "
                f"{' and '.join(words)}: those that did not fit were left out, with a line on stderr alone."
            )
            cure = f'<size memory="{-(-MORE_MEMORY * self.memory // 2**20)}M"/>'
            yield Symptom("memory", "error", text, cure, max(self.full))

    def order(self) -> Iterator[Symptom]:
        """Finding "lost_order": RK4 with hard rows should be of order 2, without rows of order 4."""
        if self.observed is not None and self.observed.severity != "ok":
            yield Symptom("lost_order", "warning" if self.looped or self.rk4 else "note", f"RK4: {self.observed.sentence}.")


def _symptoms(t: TrialRun) -> Iterator[Symptom]:
    name = "pushed" if t.pushed else "trial"
    how = f"pushed along its free motions with {t.pushed:.3g} rad/s or m/s, which the file does not do, " if t.pushed else ""
    if t.reason:
        rest = f"; {t.better} with hard loops and a quarter of the step comes through" if t.better and t.looped else ""
        text = f"{how}a run of {t.duration:.3g} s {'of it' if t.pushed else 'as the file says'} {t.reason}{rest}."
        yield Symptom(name, "warning" if t.pushed else "error", text, number=0.0)
        return
    if not t.better:
        return
    against = f"{t.better} with {'hard loops and ' if t.looped else ''}a quarter of the step"
    text = (
        f"{how}in a run of {t.duration:.3g} s the file as it is differs by {t.error:.2g} m from {against} "
        f"({100 * t.share:.2g} % of its motion; the finer run is known to {t.own:.1g} m)"
    )
    cure = '<option integrator="RK4"/>'
    if t.wild:
        text = (
            f"{how}a run of {t.duration:.3g} s as the file says reaches {t.fastest:.3g} rad/s or m/s, {t.better} with a quarter of the "
            f"step {t.fine_fastest:.3g}: the step makes them, not the mechanism."
        )
        yield Symptom(name, "warning" if t.pushed else "error", text, number=t.fastest)
        return
    if t.touched:
        acting = " and ".join(sorted(t.touched))
        far = t.error > APART * t.size
        if t.looped and t.convincing and t.share > WRONG and t.gap > SLIGHT * t.size:
            text += f", its loops open by {t.gap:.2g} m or rad"
            yield Symptom(name, "warning" if t.pushed else "error", f"{text}, beside {acting}.", number=t.error)
        elif far or t.share > WRONG:
            text += f": paths under {acting} depend on the step; compare statistics of runs."
            yield Symptom(name, "warning" if far else "note", text, number=t.error)
        return
    wrong, doubtful = (WRONG, DOUBTFUL) if t.looped else (COARSE, ROUGH)
    if not t.convincing:
        if t.share > doubtful:
            yield Symptom(name, "warning", f"{text}: something in it is not smooth, or chaotic; no run is known to that.", number=t.error)
    elif t.share > doubtful:
        severity = "error" if t.share > wrong and not t.pushed else "warning"
        yield Symptom(name, severity, f"{text}.", "" if t.looped else cure, number=t.error)


def run_trial(model: mujoco.MjModel) -> TrialRun:
    """The runs; see the module."""
    with engine():
        found = _compared(model, None)
        if found.looped and not found.reason and not found.skipped and found.moved < STILL * found.size:
            push = free_push(model, start_pose(model), found.size)
            if np.any(push):
                found = replace(found, follow=_compared(model, push))
        return found


def _compared(model: mujoco.MjModel, push: Array | None) -> TrialRun:
    h, size, looped = float(model.opt.timestep), moving_size(model), bool(loops(model))
    pushed = 0.0 if push is None else float(np.max(np.abs(push)))
    first = run_file(prepared(model, h), 1, 1, push)
    wanted = max(1, min(MOST_STEPS, round(DURATION / h)) // OUTPUTS)
    each = min(wanted, int(BUDGET / REFERENCE / OUTPUTS / price(model, first.rows)))
    if each < 1:
        skipped = f"a run: one step of {model.nv} coordinates and {first.rows} rows costs too much"
        return TrialRun(np.inf, np.inf, h, first.reason, "", size, size, looped=looped, pushed=pushed, skipped=skipped)
    as_is = run_file(prepared(model, h), each, push=push)
    if price(model, as_is.rows) * each * OUTPUTS * REFERENCE > 4.0 * BUDGET:  # the rows have grown under way
        each = max(1, int(BUDGET / REFERENCE / OUTPUTS / price(model, as_is.rows)))
        as_is = run_file(prepared(model, h), each, push=push)
    common = TrialRun(
        np.inf, np.inf, OUTPUTS * each * h, as_is.reason, "", as_is.moved, size, gap=as_is.gap, gaps=as_is.gaps,
        touched=as_is.touched, looped=looped, pushed=pushed, full=as_is.full, memory=int(model.narena),
        rk4=model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4,
    )  # fmt: skip
    if as_is.reason.startswith("ended"):
        return common
    half = run_file(prepared(model, h / 2), 2 * each, push=push)
    for better in ("RK4", "discrete"):
        fine = run_file(prepared(model, h / 4, better), 4 * each, push=push)
        middle = run_file(prepared(model, h / 2, better), 2 * each, push=push) if not fine.reason else fine
        if fine.reason or middle.reason:
            continue
        moved = max(fine.moved, 0.0 if as_is.reason else as_is.moved)
        found = replace(
            common, better=better, moved=moved, error=as_is.apart(fine),
            own=fine.apart(middle), step=as_is.apart(half), fastest=as_is.fastest, fine_fastest=fine.fastest,
            energy=as_is.energy_off(fine), fine_gap=fine.gap, touched=as_is.touched | fine.touched,
        )  # fmt: skip
        return replace(found, observed=_order(model, found, each, push) if better == "RK4" else None)
    return replace(common, step=as_is.apart(half), skipped="the motion: no finer run of it came through to compare with")


def _order(model: mujoco.MjModel, found: TrialRun, each: int, push: Array | None) -> Finding | None:
    """The order of RK4 at the timestep of the file, its half and quarter; None where contacts lower it anyway, or where the steps
    change nothing that matters."""
    if found.touched or found.reason or found.own < SEEN * found.size:
        return None
    between = FILE_STEPS * float(model.opt.timestep)
    outputs = max(1, OUTPUTS * each // FILE_STEPS)

    def run(name: str, hard: bool, steps: int) -> FileTrace:
        run = run_file(prepared(model, between / steps, name), steps, outputs, push)
        return FileTrace(run.points, run.energy, run.gap, 0.0, 0, run.reason)

    return file_order(run, model, found.looped, between)

