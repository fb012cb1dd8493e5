"""The SI units of the keys that a mechanism takes: what `37deg` behind a key is checked against.

A joint or shaft X: X and X_0 [rad or m], X_rate and X_rate_0, X_accel, X_force [N m or N]. A frame F: F_x [m], F_x_rate,
F_x_accel, F_wx [rad/s], F_wx_rate. Keys of a question: its own `units`, completed by the same suffixes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from mechlab.experiment.entry import Entry
from mechlab.experiment.question import Question
from mechlab.mechanism.model import Mechanism
from mechlab.values import has_unit, in_unit

FORCES = {"m": "N", "rad": "N m"}
Units = dict[str, tuple[str, ...]]
"""Key -> the SI units that fit it; several where the mechanism does not fix one."""


def mechanism_units(m: Mechanism) -> Units:
    """Units of all keys of joints, shafts and frames. A shaft over slides may be an angle or a length: both fit."""
    slides = {j.name for j in m.joints if j.kind == "prismatic"}
    out: Units = {}
    shafts = {s.name: {n for n, _ in s.coefficients} for s in m.shafts}
    for name in m.scalar_names:
        bases: tuple[str, ...] = ("m",) if name in slides else ("rad",)
        if shafts.get(name, set()) & slides:
            bases = ("rad", "m")
        out |= dict.fromkeys((name, f"{name}_0"), bases)
        out |= {key: tuple(f"{b}/s" for b in bases) for key in (f"{name}_rate", f"{name}_rate_0")}
        out[f"{name}_accel"] = tuple(f"{b}/s2" for b in bases)
        out[f"{name}_force"] = tuple(FORCES[b] for b in bases)
    for frame in m.frames:
        for a in "xyz":
            key = f"{frame.name}_{a}"
            out |= {key: ("m",), f"{key}_rate": ("m/s",), f"{key}_accel": ("m/s2",)}
            key = f"{frame.name}_w{a}"
            out |= {key: ("rad/s",), f"{key}_rate": ("rad/s2",)}
    return out


def question_units(question: Question) -> Units:
    """Units of the keys of a question: declared, an angle, or by the suffix _rate or _accel of a key that has one."""
    known = dict.fromkeys(question.angles, "rad") | dict(question.units)
    keys = (*question.given, *question.optional, *question.answers)
    for key in keys:
        for suffix, per in (("_rate", "/s"), ("_accel", "/s2")):
            base = key.removesuffix(suffix)
            stem = base if base in known else f"{base}_angle"
            if key not in known and key != base and stem in known:
                known[key] = known[stem] + per
    return {k: (known[k],) for k in keys if k in known}


def entry_units(entry: Entry, mechanisms: Iterable[Mechanism] = ()) -> Units:
    """Units of all keys beside the parameters: those of the workspace, of `mechanisms`, and of the questions."""
    out: Units = {}
    for m in mechanisms:
        for key, units in mechanism_units(m).items():
            out[key] = tuple(dict.fromkeys((*out.get(key, ()), *units)))
    if entry.workspace is not None:
        out |= {k: (u,) for k, u in entry.workspace.units.items()}
        out |= {k: (limit.unit,) for k, limit in entry.workspace.limits.items()}
    for question in entry.questions:
        out |= question_units(question)
    return out


def checked(values: Mapping[str, Any], units: Units) -> dict[str, Any]:
    """The values, text among them read; raises MechlabError for one whose unit does not fit its key."""
    return {
        k: in_unit(k, v, *units[k]) if k in units and (has_unit(v) or isinstance(v, str)) else v
        for k, v in values.items()
    }
