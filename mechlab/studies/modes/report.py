"""Modes as one line and as text."""

from __future__ import annotations

import numpy as np

from mechlab.results import line_of, text_of
from mechlab.studies.modes.eigen import RIGID, UNSTABLE, VibrationMode
from mechlab.studies.modes.result import ModesResult
from mechlab.tables import number, table


@line_of.register
def _(found: ModesResult) -> str:
    return f"Modes of {found.name}, {found.scene}: {found.message}"


@text_of.register
def _(found: ModesResult) -> str:
    """The equilibrium, a table of modes, the frequencies of each witness, notes and warnings."""
    lines = [f"{found.name}, {found.scene}, fidelity {found.fidelity}: equilibrium and small motions about it"]
    lines += [f"what acts: {found.acts}"] if found.acts else []
    rows = [[n, number(v, 7)] for n, v in found.equilibrium.items()]
    lines += [
        "",
        table(["joint or shaft", "at rest [rad or m]"], rows),
        f"unbalanced: {found.first.residual:.2g} N m or N",
        "",
    ]
    heads = ["", "kind", "Hz", "omega [rad/s]", "error", "damping", "eigenvalues [1/s]", "shape (largest first)"]
    lines.append(table(heads, [_row(found, k, m) for k, m in enumerate(found.modes, 1)]))
    lines.append("")
    for n, w in found.witnesses.items():
        lines.append(f"{n}: {w.cannot or 'omega ' + (', '.join(number(m.omega, 9) for m in w.modes[:6]) or 'none')}")
    lines.append(
        f"largest difference between the witnesses: {number(found.max_difference)} (relative {number(found.relative_difference)})"
    )
    lines += [f"note: {n}" for n in found.notes]
    lines += [
        f"UNSTABLE: mode {k} grows with {m.growth:.4g} 1/s ({_words(found, m)})"
        for k, m in enumerate(found.modes, 1)
        if m.kind == UNSTABLE
    ]
    lines += [
        f"rigid: mode {k} has no stiffness ({_words(found, m)})"
        for k, m in enumerate(found.modes, 1)
        if m.kind == RIGID
    ]
    lines += [f"{kind}: {path}" for kind, path in found.files.items()]
    return "\n".join([*lines, found.message])


def _row(found: ModesResult, k: int, m: VibrationMode) -> list[str]:
    roots = ", ".join(f"{r.real:.4g}{r.imag:+.4g}i" if r.imag else f"{r.real:.4g}" for r in m.eigenvalues)
    numbers = [number(m.frequency_hz, 6), number(m.omega, 8), number(m.error, 2), number(m.damping)]
    return [str(k), m.kind, *numbers, roots, _words(found, m)]


def _words(found: ModesResult, m: VibrationMode) -> str:
    shape = dict(zip(found.mechanism.rate_names, np.real(m.shape).tolist(), strict=True))
    top = sorted((n for n, x in shape.items() if abs(x) > 1e-3), key=lambda n: -abs(shape[n]))
    return ", ".join(f"{n} {shape[n]:+.3g}" for n in top[:SHOWN]) + (", ..." if len(top) > SHOWN else "")


SHOWN = 4
