"""The recording of a run: states, channels, cost, and the health record that says whether the run can be trusted.

`mechlab.formats` saves a Recording as one .npz file; `mechlab.experiment.report` prints it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.clock import CostParts
from mechlab.errors import MechlabError, explained, unknown
from mechlab.experiment.scene import Settings
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import is_length
from mechlab.mechanism.many_states import ManyStates
from mechlab.mechanism.model import Mechanism
from mechlab.results import Result, Shown

SEVERITIES = ("ok", "warning", "error")


@dataclass(frozen=True)
class Finding:
    """One finding on a run. severity "ok": within its limit; "warning": may matter; "error": the run must not be
    trusted."""

    name: str
    value: float
    limit: float
    unit: str
    severity: str
    sentence: str

    def to_dict(self) -> dict[str, object]:
        """JSON-able form."""
        return {
            "name": self.name, "value": self.value, "limit": self.limit, "unit": self.unit,
            "severity": self.severity, "sentence": self.sentence,
        }  # fmt: skip


def limit_finding(name: str, value: float, limit: float, unit: str, what: str, warn: float | None = None) -> Finding:
    """A finding from a number and its limit: error above the limit (or not finite), warning above `warn`."""
    if not value <= limit:
        return Finding(
            name,
            value,
            limit,
            unit,
            "error",
            f"{what} {value:.3g} {unit} is beyond the limit {limit:.3g} {unit}; do not trust this run",
        )
    if warn is not None and value > warn:
        return Finding(name, value, warn, unit, "warning", f"{what} {value:.3g} {unit} is above {warn:.3g} {unit}")
    return Finding(name, value, limit, unit, "ok", f"{what} {value:.3g} {unit} (limit {limit:.3g} {unit})")


@dataclass(frozen=True)
class Symptom:
    """One finding about a model file: a name, its severity ("error": results of the file as it is cannot be trusted; "warning";
    "note": a default, or a matter of other tools), a sentence with the numbers, and text to paste into the file ("" for none);
    number: the measured value that the sentence is about; consequence: what it does to a user's results."""

    name: str
    severity: str
    sentence: str
    paste: str = ""
    number: float | None = None
    consequence: str = ""

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "name": self.name, "severity": self.severity, "sentence": self.sentence, "paste": self.paste,
            "number": self.number, "consequence": self.consequence,
        }  # fmt: skip


@explained
@dataclass(frozen=True, repr=False)
class Health(Shown):
    """All findings of a run."""

    findings: tuple[Finding, ...] = ()

    @property
    def trusted(self) -> bool:
        """False when any finding is an error."""
        return all(f.severity != "error" for f in self.findings)

    @property
    def exit_code(self) -> int:
        """0, or 3 when the run must not be trusted."""
        return 0 if self.trusted else 3

    def finding(self, name: str) -> Finding:
        """The finding of that name; raises KeyError."""
        return {f.name: f for f in self.findings}[name]

    def __add__(self, other: Health) -> Health:
        return Health(self.findings + other.findings)


@dataclass(frozen=True)
class Cost:
    """The cost of a run. total_s: all CPU seconds from the call to the returned recording, the sum of `parts`; 0 where it was not
    counted. cpu_s: CPU seconds of stepping alone, under a `max_error` of all runs of the error control. steps, evaluations of the
    equations of motion: of the returned motion."""

    cpu_s: float = 0.0
    steps: int = 0
    evaluations: int = 0
    total_s: float = 0.0
    parts: CostParts = CostParts()


@explained
@dataclass(frozen=True, repr=False)
class Recording(Result[Path]):
    """A run of a mechanism.

    t (n,) [s]; q (n, nq), v (n, nv) as in the Mechanism; `channels` name -> (n,) values, in SI; `units` name -> unit;
    `errors` name -> estimated largest error of a channel over the run, in its unit (absent: no estimate); `acts`: one
    line on what acted (`mechlab.experiment.acting`); `sample_times` [s]: times at which `samples` reads the channels;
    `notes`: warnings about the parameters. Files (`mechlab.formats.save_recording`) hold neither `sample_times` nor
    `notes`.
    """

    written_by = "mechlab.formats.recording_npz"

    mechanism: Mechanism
    t: Array
    q: Array
    v: Array
    channels: dict[str, Array] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    health: Health = Health()
    cost: Cost = Cost()
    settings: Settings = Settings()
    scene: str = ""
    name: str = ""
    fidelity: str = ""
    parameters: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    acts: str = ""
    sample_times: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()

    def __getitem__(self, channel: str) -> Array:
        return self.channel(channel)

    @property
    def recording(self) -> Recording:
        """The recording itself, for callers that expect a result which holds one."""
        return self

    @property
    def exit_code(self) -> int:
        """0, or 3 when the run must not be trusted."""
        return self.health.exit_code

    @property
    def message(self) -> str:
        """The sentences of all findings of severity "error"; "finished" when there are none."""
        return "; ".join(f.sentence for f in self.health.findings if f.severity == "error") or "finished"

    def channel(self, name: str) -> Array:
        """(n,) values of a channel; raises MechlabError, listing the channels, for an unknown name."""
        if name not in self.channels:
            raise unknown(f"{self.name or self.mechanism.name}: channel", name, self.channels)
        return self.channels[name]

    def at(self, name: str, t: float) -> float:
        """Value of a channel at time t [s]: exact at a recorded time, else a cubic through four neighbours.

        Raises MechlabError when t lies outside the run.
        """
        values = self.channel(name)
        span = self.t[-1] - self.t[0]
        if not self.t[0] - 1e-9 * span <= t <= self.t[-1] + 1e-9 * span:
            raise MechlabError(f"time {t:g} s lies outside the run ({self.t[0]:g} to {self.t[-1]:g} s).")
        k = int(np.argmin(np.abs(self.t - t)))
        if abs(self.t[k] - t) <= 1e-9 * max(span, 1e-12) or len(self.t) < 4:
            return float(values[k])
        i = int(np.clip(np.searchsorted(self.t, t) - 2, 0, len(self.t) - 4))
        x, y = self.t[i : i + 4], values[i : i + 4]
        weights = [np.prod([(t - x[m]) / (x[j] - x[m]) for m in range(4) if m != j]) for j in range(4)]
        return float(np.dot(weights, y))

    def final(self) -> dict[str, float]:
        """Last value of every channel."""
        return {name: float(values[-1]) for name, values in self.channels.items()}

    def with_channels(self, channels: Mapping[str, Array], units: Mapping[str, str]) -> Recording:
        """The same run with more channels."""
        return replace(self, channels=self.channels | dict(channels), units=self.units | dict(units))

    def samples(self) -> list[dict[str, float]]:
        """Time and all channels at each of the sample times that the run has reached (it may have ended early)."""
        reached = [t for t in self.sample_times if t <= self.t[-1] * (1 + 1e-12)]
        return [{"t": t} | {name: self.at(name, t) for name in self.channels} for t in reached]

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "scene": self.scene, "acts": self.acts, "fidelity": self.fidelity,
            "engine": self.settings.engine, "integrator": self.settings.integrator, "timestep": self.settings.timestep,
            "duration": float(self.t[-1]), "final": self.final(), "samples": self.samples(),
            "units": dict(self.units), "errors": dict(self.errors),
            "health": [f.to_dict() for f in self.health.findings], "parameters": dict(self.parameters),
            "cost": asdict(self.cost), "message": self.message,
            "status": "finished" if self.health.trusted else "finished, do not trust it", "notes": list(self.notes),
        }  # fmt: skip


@dataclass(frozen=True)
class Trace:
    """A run without channels: q (n, nq), v (n, nv) at the first n output times; cpu_s: process CPU time of stepping,
    without setup; `reason`: why it ended early, empty when it reached the end; `evaluations` of the equations of
    motion, 0 where the engine does not count them; total_s: process CPU time of building the engine's model, stepping
    and output, nan where it is not measured."""

    q: Array
    v: Array
    cpu_s: float
    steps: int
    reason: str = ""
    evaluations: int = 0
    total_s: float = math.nan

    @property
    def complete(self) -> bool:
        """True when the end was reached."""
        return not self.reason


def state_channels(mechanism: Mechanism) -> frozenset[str]:
    """Names of the `basic_channels`."""
    points = [f"{f.name}_{letter}" for f in mechanism.frames for letter in "xyz"]
    return frozenset([*mechanism.scalar_names, *(f"{n}_rate" for n in mechanism.scalar_names), *points])


def basic_channels(mechanism: Mechanism, q: Array, v: Array) -> tuple[dict[str, Array], dict[str, str]]:
    """Channels of every run, with units: value and `_rate` of each joint and shaft, `_x _y _z` of each frame."""
    channels: dict[str, Array] = {}
    units: dict[str, str] = {}
    for name in mechanism.scalar_names:
        unit = "m" if is_length(mechanism, name) else "rad"
        channels[name] = mechanism.value(name, q)
        channels[f"{name}_rate"] = v @ mechanism.row(name)
        units |= {name: unit, f"{name}_rate": f"{unit}/s"}
    if mechanism.frames:
        points = frame_positions(mechanism, q)
        for k, frame in enumerate(mechanism.frames):
            for axis, letter in enumerate("xyz"):
                channels[f"{frame.name}_{letter}"] = points[:, k, axis]
                units[f"{frame.name}_{letter}"] = "m"
    return channels, units


def run_channels(
    mechanism: Mechanism, q: Array, v: Array, a: Array, forces: Mapping[str, Array]
) -> tuple[dict[str, Array], dict[str, str]]:
    """`basic_channels`; NAME_accel of each joint and shaft, from accelerations a (n, nv); NAME_force (n,) of what laws act on."""
    channels, units = basic_channels(mechanism, q, v)
    for name in mechanism.scalar_names:
        channels[f"{name}_accel"] = a @ mechanism.row(name)
        units[f"{name}_accel"] = f"{units[name]}/s2"
    for name, values in forces.items():
        channels[f"{name}_force"] = values
        units[f"{name}_force"] = force_unit(units[name])
    return channels, units


def force_unit(coordinate: str) -> str:
    """The unit of a force on a coordinate in m or rad."""
    return "N" if coordinate == "m" else "N m"


def over_samples(forces: Sequence[Mapping[str, float]]) -> dict[str, Array]:
    """Joint or shaft -> (n,) force at each of n samples, 0 where no law acts."""
    names = dict.fromkeys(name for now in forces for name in now)
    return {name: np.array([now.get(name, 0.0) for now in forces]) for name in names}


def frame_positions(mechanism: Mechanism, q: Array) -> Array:
    """(n, frames, 3) world positions of the frames along coordinates q (n, nq)."""
    return ManyStates(mechanism, q).frame_positions()
