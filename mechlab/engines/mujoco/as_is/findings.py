"""The health record of a run of a file: blow-up, energy, overlap of parts, gaps of the file's loops, warnings of the engine.

The limits are those of a physical result, not those of hard constraints: the softness of a stranger's file is its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from mechlab.engines.mujoco.as_is.contacts import ContactWatch
from mechlab.engines.mujoco.engine_warnings import engine_warnings, words_of
from mechlab.engines.mujoco.model_file.rows import name_of
from mechlab.engines.mujoco.model_file.start import outside_ranges
from mechlab.engines.mujoco.stepping import SteppingEnd
from mechlab.experiment.energy import NOTHING, nothing_moved
from mechlab.experiment.recording import Finding, Health, limit_finding
from mechlab.experiment.scene import Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.validate import RecordedTree
from mechlab.tables import counted

ENERGY_WARNING, ENERGY_LIMIT = 0.02, 0.2
"""Energy that steps made or lost, as a share of what the run turned over."""
GAP_WARNING, GAP_LIMIT = 1e-4, 1e-2
"""Gap of an equality, as a share of the mechanism's length scale (angles: [rad])."""
OVERLAP_WARNING, OVERLAP_LIMIT = 0.01, 0.1
"""Depth of a contact, as a share of the extent of the model."""
NOISE = 1e-9
"""Energies below this [J] times the number of coordinates are rounding."""


def health(
    mechanism: Mechanism, settings: Settings, duration: float, model: mujoco.MjModel, data: mujoco.MjData,
    blow_up: SteppingEnd | None, energies: Array, contacts: ContactWatch,
) -> Health:  # fmt: skip
    """All findings. energies (n, 4) [J]: potential, kinetic, net work of other forces and the sum of its absolute parts."""
    out: list[Finding] = []
    if blow_up is not None:
        text = (
            f"the run of the file blew up at t = {blow_up.t:.6g} s and ended there, where MuJoCo would start anew without a word: "
            f"{blow_up.reason}. Try a smaller timestep (now {settings.timestep:g} s)"
        )
        out.append(Finding("blow_up", blow_up.t, duration, "s", "error", text))
    finite = bool(np.all(np.isfinite(energies)))
    out.append(
        Finding("finite", float(not finite), 0.0, "states", "ok" if finite else "error",
                "all states are finite" if finite else "a state or an energy is not finite; do not trust this run")
    )  # fmt: skip
    if finite and len(energies) > 1:
        out.append(energy_finding(model, energies, contacts.stops))
    out += _gaps(mechanism, contacts)
    if contacts.deepest > 0.0:
        extent = float(model.stat.extent)
        text = f"parts overlap by up to (between {' and '.join(contacts.pair)}, at t = {contacts.deepest_at:.3g} s)"
        out.append(
            limit_finding("penetration", contacts.deepest, OVERLAP_LIMIT * extent, "m", text, OVERLAP_WARNING * extent)
        )
    out += engine_warnings(data)
    return Health(tuple(out))


def gave_up(error: Exception, t: float) -> str:
    """Sentence on an error of the engine that ends a run after time t [s]; of a full memory with what to do."""
    text = f"MuJoCo gave up after t = {t:.6g} s of the run as the file is: {words_of(error)}."
    return f'{text} Raise memory in its <size memory="..."/>, or leave it out.' if "<size memory" in str(error) else text


def energy_finding(model: mujoco.MjModel, energies: Array, stops: Sequence[str] = ()) -> Finding:
    """Finding "energy_balance": the largest |E(t) - E(0) - work(t)| as a share of the energy that the run turned over. stops: of
    each sample the joint whose stop pushes, which is named where most of what is left over arose with such a push."""
    potential, kinetic, done, turned = energies.T
    total = potential + kinetic
    left = total - total[0] - done
    open_ = np.abs(left)
    turnover = max(float(np.max(kinetic)), float(np.ptp(potential)), float(turned[-1]), NOTHING)
    noise = max(NOISE * max(model.nv, 1), 1e-12 * float(np.max(np.abs(potential))))
    worst = float(np.max(open_))
    value = worst / turnover if worst > noise else 0.0
    if turnover == NOTHING and value == 0.0:
        return nothing_moved(ENERGY_LIMIT)
    text = f"energy balance with contacts and actuators: at most {worst:.3g} J of {turnover:.3g} J turned over is unaccounted for:"
    found = limit_finding("energy_balance", value, ENERGY_LIMIT, "of the turnover", text, ENERGY_WARNING)
    name = "" if found.severity == "ok" else _throwing_stop(np.abs(np.diff(left)), stops)
    if not name:
        return found
    more = (
        f"; most of it where the stop of joint {name} throws back what runs into it. What the stop itself takes or gives is in the "
        "balance: the rest is of the timestep. Take a smaller one, or a start within the range"
    )
    return replace(found, sentence=found.sentence + more)


def _throwing_stop(jumps: Array, stops: Sequence[str]) -> str:
    """The joint whose stop pushes in the largest of the jumps (n - 1,) between n samples, if stops push in most of their sum."""
    pushing = [a or b for a, b in zip(stops, stops[1:], strict=False)]
    share = np.where([bool(name) for name in pushing], jumps[: len(pushing)], 0.0)
    return pushing[int(np.argmax(share))] if pushing and 2.0 * share.sum() > jumps.sum() else ""


def _gaps(mechanism: Mechanism, contacts: ContactWatch) -> list[Finding]:
    if not contacts.gaps:
        return []
    name = max(contacts.gaps, key=lambda n: contacts.gaps[n])
    scale = mechanism.length_scale
    text = f"the file's own equalities give way by up to (at {name})"
    found = limit_finding("loop_gap", contacts.gaps[name], GAP_LIMIT * scale, "m or rad", text, GAP_WARNING * scale)
    if found.severity == "ok":
        return [found]
    more = "; they are soft rows: `mechlab doctor` says how to harden them"
    if not isinstance(mechanism, RecordedTree):
        more += ", and --engine mujoco runs hard ones"
    return [Finding(found.name, found.value, found.limit, found.unit, found.severity, found.sentence + more)]


def start_finding(states: Array, model: mujoco.MjModel) -> Finding | None:
    """Finding "start_range": joints that start outside their range, which their soft stops push back; None without any."""
    outside = outside_ranges(model, states)
    if not outside:
        return None
    k = max(outside, key=outside.__getitem__)
    far = outside[k]
    who = f"{counted(len(outside), 'joint')} start{'s' if len(outside) == 1 else ''} outside the range"
    text = f"{who}, {name_of(model, 'JOINT', k)} by {far:.3g} rad or m: the stops push back. Give a start inside"
    return Finding("start_range", far if math.isfinite(far) else 0.0, 0.0, "rad or m", "warning", text)
