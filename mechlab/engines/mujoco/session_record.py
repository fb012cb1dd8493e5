"""The Recording of a session: its kept states are evaluated anew, each at its own state, and judged like those of a run."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import controlled, engine
from mechlab.engines.mujoco.drive import Driver
from mechlab.engines.mujoco.findings import health, masses_finding
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.mujoco.runner import versions
from mechlab.engines.mujoco.samples import RunSamples
from mechlab.engines.mujoco.session_kept import Kept
from mechlab.experiment.acting import drive_law
from mechlab.experiment.assembly_modes import ModeWatch
from mechlab.experiment.energy import dissipation
from mechlab.experiment.energy import work as work_of
from mechlab.experiment.findings import open_loop_finding, saturation_finding
from mechlab.experiment.recording import Cost, Finding, Health, Recording
from mechlab.mechanism.geometry import Array

MAX_SAMPLES = 1000


class _Replay:
    """What samples ask of a Driver: forces and work of drives and laws at the kept states."""

    def __init__(self, session: Kept, data: mujoco.MjData) -> None:
        s = session
        self.drives = s.drives
        self.laws = Driver(s.mechanism, s.scene.laws, MujocoPlant(s.mechanism, s.model, data, s.map))
        self.targets = tuple(dict.fromkeys((*self.drives.on, *self.laws.targets)))
        self.work = 0.0
        self.leads = False
        self._forces: Array = np.zeros(0)

    @property
    def sampling(self) -> bool:
        """Whether forces are evaluated for the record only; always."""
        return True

    @sampling.setter
    def sampling(self, value: bool) -> None:
        self.laws.sampling = True

    def go(self, row: Array, held: Array, work: float) -> None:
        """To a kept row, under the control that was held after it."""
        value, rate, _, current = self.drives.at(row[None])
        self._forces = self.drives.forces(value, rate, held[None], current)[0] if len(held) else np.zeros(0)
        self.work = work

    def now(self) -> list[float]:
        """Forces in the order of `targets`."""
        total = {name: self.laws.forces.get(name, 0.0) for name in self.targets}
        for name, f in zip(self.drives.on, self._forces.tolist(), strict=True):
            total[name] += f
        return [total[name] for name in self.targets]


def recording_of(session: Kept) -> Recording:
    """See `Session.recording`."""
    s, m = session, session.mechanism
    rows = s.rows[: s.count + 1]
    some = np.unique(np.linspace(0, len(rows) - 1, min(len(rows), MAX_SAMPLES)).round().astype(int))
    data = mujoco.MjData(s.model)
    replay = _Replay(s, data)
    samples = RunSamples(s.model, data, s.map, replay, ModeWatch(m, ()))
    work = s.fed + s.called
    spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
    with controlled(data, replay.laws) if replay.laws.called else engine():
        for k in some:
            mujoco.mj_setState(s.model, data, rows[k][: mujoco.mj_stateSize(s.model, spec)], spec)
            held = rows[min(k + 1, s.count)][rows.shape[1] - s.model.nu :]
            data.ctrl[:] = held
            replay.go(rows[k], held, float(work[k]))
            samples.take(float(rows[k, 0]))
    states = samples.states
    for law in s.scene.laws if replay.laws.at_once else ():
        moved = m.value(law.on, states[0])  # type: ignore[attr-defined]
        samples.more_work += law.value * (moved - moved[0])  # type: ignore[attr-defined]
    # the health record takes the losses between samples off again; here they are in the energy fed, at every kept state
    samples.more_work += work_of(np.array(samples.t), dissipation(m, *states))
    samples.allowance = s.allowance
    return _written(s, samples, data)


def _written(s: Kept, samples: RunSamples, data: mujoco.MjData) -> Recording:
    """The Recording of evaluated samples; `data`: an MjData for what the engine counted."""
    m, t = s.mechanism, np.array(samples.t)
    states, (channels, units) = samples.states, samples.channels()
    kept = s.rows[: s.count + 1]
    commands = s.drives.command(kept[:, kept.shape[1] - s.model.nu :])
    after = np.minimum(np.searchsorted(kept[:, 0], t) + 1, s.count)
    for k, (name, unit) in enumerate(zip(s.drives.names, s.drives.units, strict=True)):
        channels[f"{name}_command"], units[f"{name}_command"] = commands[after, k], unit
    for mine, its in zip(data.warning, s.data.warning, strict=True):
        mine.number, mine.lastinfo = its.number - 1, its.lastinfo  # `silence` counted one
    scene = replace(s.scene, duration=max(float(t[-1]), s.hold))
    torn = s.loops.worst
    blow_up = s.end if torn is None else None
    findings = [*health(m, scene, s.settings, data, blow_up, samples).findings, *_of_drives(s, samples)]
    watched = samples.loops.finding(scene.duration)
    if watched is None and torn is not None:
        watched = open_loop_finding(torn[0], torn[1], s.loops.limit, scene.duration, torn[2])
    ahead = [f for f in (watched, masses_finding(s.map, states[0][0])) if f is not None]
    steps = round(float(t[-1]) / s.settings.timestep)
    return Recording(
        mechanism=m, t=t, q=states[0], v=states[1], channels=channels, units=units, health=Health((*ahead, *findings)),
        cost=Cost(0.0, steps, (4 if s.settings.integrator == "RK4" else 1) * steps), settings=s.settings,
        scene=s.scene.name, name=m.name, fidelity=s.scene.fidelity, versions=versions(), acts=_acts(s),
    )  # fmt: skip


def _of_drives(s: Kept, samples: RunSamples) -> list[Finding]:
    """Findings on the drives: forces at their limits, and currents, which the engine integrates in first order."""
    out = []
    laws = [law for d in s.mechanism.drives if (law := drive_law(s.mechanism, d)) is not None]
    saturated = saturation_finding(laws, samples.forces)
    if saturated is not None:
        out.append(saturated)
    if s.model.na:
        text = "currents of windings are integrated by the engine, in first order of the timestep"
        out.append(Finding("currents", s.settings.timestep, 0.0, "s", "ok", text))
    return out


def _acts(s: Kept) -> str:
    """What the session commands, in words; the engine's runner has none for it."""
    names = ", ".join(f"{n} [{u}]" for n, u in zip(s.drives.names, s.drives.units, strict=True))
    others = ", ".join(f"{law.kind} on {', '.join(law.targets())}" for law in s.scene.laws)
    parts = [f"commands of a session to {names}" if names else "a session without drives", others]
    return "; ".join(x for x in parts if x)
