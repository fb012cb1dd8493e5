"""What the mechanisms of the catalog were when their numbers were last looked at: a few numbers of each, on record.

Three engines that are given one Mechanism agree on it, right or wrong. The record is the fourth witness: it tells that a
mass, a sign or a point of a builder is another one than before. `python -m tests.faults.record` writes it anew; do that
after a change that is meant, together with `mechlab generate --catalog`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.experiment.check import Check, Measured
from mechlab.experiment.entry import Entry
from mechlab.experiment.parameters import make
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, integrate
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import passive_force

FILE = Path(__file__).with_suffix(".json")
AGAIN = "after a change that is meant: python -m tests.faults.record"
TOLERANCE = 1e-8
"""Relative. The reference pose is assembled to 1e-12, and turned into a number of another size by stiff springs."""


def marks(m: Mechanism) -> dict[str, Array]:
    """What a mechanism is at two fixed random states: poses, points, values, mass matrix, forces, residual of the rows."""
    out: dict[str, Array] = {"counts": np.array([len(m.loops), len(m.relations), len(m.springs), m.nv], dtype=float)}
    rng = np.random.default_rng(11)
    for k in range(2):
        q = integrate(m, m.reference(), 0.2 * rng.standard_normal(m.nv))
        tree, rows = TreeKinematics(m, q, rng.standard_normal(m.nv)), ConstraintSet(m)
        poses = {f.name: tree.pose(f.body) for f in m.frames}
        points = [poses[f.name][1] + poses[f.name][0] @ f.placement.translation for f in m.frames]
        out |= {
            f"points{k}": np.array(points), f"poses{k}": np.array([np.column_stack(tree.pose(b.name)) for b in m.bodies]),
            f"values{k}": np.array([np.asarray(m.value(n, q), dtype=float).ravel()[0] for n in m.scalar_names]),
            f"mass{k}": tree.mass_matrix(), f"forces{k}": tree.bias_force() - passive_force(tree), f"rows{k}": rows.residual(tree),
        }  # fmt: skip
    return out


def digest(m: Mechanism) -> dict[str, list[float]]:
    """Mark -> its norm and two fixed random projections of it."""
    out = {}
    for key, x in marks(m).items():
        rng = np.random.default_rng(len(key))
        flat = np.ravel(x)
        out[key] = [float(np.linalg.norm(flat)), *(float(rng.standard_normal(flat.size) @ flat) for _ in range(2))]
    return out


def of_entry(entry: Entry) -> dict[str, dict[str, list[float]]]:
    """Fidelity -> digest, at the default parameters."""
    p = make(entry.parameters, {}, entry.name)
    return {f: digest(entry.build(p, f)) for f in entry.fidelities if f != "kinematic"}


def on_record(entry: Entry) -> tuple[Check, ...]:
    """G7 for an entry of the catalog that is on record; nothing for others."""
    if not entry.parameters.__module__.startswith("mechlab.catalog"):
        return ()
    return (Check("G7", "as on record, at the default parameters", lambda p: _compared(entry), "study/record.json"),)


def _compared(entry: Entry) -> Measured:
    kept: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
    known = kept["mechanisms"].get(entry.name, {})
    now, then = [], []
    for fidelity, numbers in of_entry(entry).items():
        for key, values in numbers.items():
            before = known.get(fidelity, {}).get(key, [np.nan] * 3)
            scale = max(abs(before[0]), 1e-12)
            now.append(np.array(values) / scale)
            then.append(np.array(before) / scale)
    return Measured({"now": np.array(now)}, TOLERANCE, np.array(then), f"relative; recorded {kept['date']} ({AGAIN})")
