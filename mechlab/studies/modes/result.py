"""The modes of a mechanism as data: the equilibrium, the modes of every witness, and how far the witnesses differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.results import Shown
from mechlab.studies.modes.eigen import VibrationMode
from mechlab.tables import counted, number

AGREED = 1e-6
"""Largest relative difference of eigenvalues between witnesses, beyond their errors, at which the result is trusted."""


@dataclass(frozen=True)
class ModesWitness:
    """The result of one witness: coordinates q (nq,) at rest, unbalanced force [N m or N], modes; or why it has
    none."""

    q: Array = field(default_factory=lambda: np.zeros(0))
    residual: float = 0.0
    modes: tuple[VibrationMode, ...] = ()
    cannot: str = ""


@dataclass(frozen=True, repr=False)
class ModesResult(Shown):
    """Modes of a mechanism about its equilibrium. The numbers are those of the first witness with a result; the others
    check."""

    name: str
    mechanism: Mechanism
    scene: str
    fidelity: str
    witnesses: Mapping[str, ModesWitness]
    notes: tuple[str, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    acts: str = ""
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def answering(self) -> dict[str, ModesWitness]:
        """The witnesses that could answer."""
        return {n: w for n, w in self.witnesses.items() if not w.cannot}

    @property
    def first(self) -> ModesWitness:
        """The witness whose numbers are shown."""
        return next(iter(self.answering.values()))

    @property
    def modes(self) -> tuple[VibrationMode, ...]:
        """The modes, slowest first."""
        return self.first.modes

    @property
    def q(self) -> Array:
        """(nq,) coordinates at rest."""
        return self.first.q

    @property
    def equilibrium(self) -> dict[str, Any]:
        """Physical values of joints and shafts at rest; a spherical joint's quaternion (w, x, y, z)."""
        return values_at(self.mechanism, self.q)

    @property
    def max_difference(self) -> float | None:
        """Largest difference between two witnesses, of an equilibrium value [rad or m] or eigenvalue [1/s]; None with
        one witness."""
        return self._differences()[0]

    @property
    def relative_difference(self) -> float | None:
        """Largest difference of an eigenvalue between two witnesses, relative to the largest eigenvalue of its mode."""
        return self._differences()[1]

    @property
    def exit_code(self) -> int:
        """0, or 3 when the witnesses differ by more than their errors."""
        return 0 if self._differences()[2] <= AGREED else 3

    @property
    def message(self) -> str:
        """One sentence on what was found."""
        kinds = [m.kind for m in self.modes]
        counts = [f"{kinds.count(k)} {k}" for k in dict.fromkeys(kinds)]
        text = f"{counted(len(kinds), 'mode')}: {', '.join(counts)}" if kinds else "no freedom: nothing can move"
        if self.exit_code:
            text += f"; the witnesses differ by {number(self.relative_difference)} of an eigenvalue: do not trust it"
        return text

    def _differences(self) -> tuple[float | None, float | None, float]:
        """Largest absolute and relative difference, and largest relative one beyond the errors."""
        answering = list(self.answering.values())
        absolute: list[float] = []
        relative, beyond = [0.0], [0.0]
        for i, a in enumerate(answering):
            for b in answering[:i]:
                moved = np.abs(a.q - b.q)
                absolute.append(float(np.max(moved, initial=0.0)))
                gaps = eigenvalue_gaps(a.modes, b.modes)
                absolute += [g for g, _, _ in gaps]
                relative += [r for _, r, _ in gaps]
                beyond += [b for _, _, b in gaps]
        return (max(absolute), max(relative), max(beyond)) if absolute else (None, None, 0.0)

    def shape(self, mode: VibrationMode) -> dict[str, float]:
        """Joint or shaft -> real part of its displacement in a mode; the largest joint entry is 1."""
        return self._parts(np.real(mode.shape))

    def phase(self, mode: VibrationMode) -> dict[str, float]:
        """Joint -> phase lead [rad], for a mode whose parts move out of phase; empty for a real shape."""
        if np.max(np.abs(np.imag(mode.shape)), initial=0.0) < 1e-6:
            return {}
        return dict(zip(self.mechanism.rate_names, np.angle(mode.shape).tolist(), strict=True))

    def _parts(self, shape: Array) -> dict[str, float]:
        m = self.mechanism
        out = dict(zip(m.rate_names, shape.tolist(), strict=True))
        return out | {s.name: float(m.row(s.name) @ shape) for s in m.shafts}

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "name": self.name, "scene": self.scene, "acts": self.acts, "fidelity": self.fidelity, "equilibrium": self.equilibrium,
            "residual": self.first.residual, "modes": [self._mode(m) for m in self.modes],
            "answers": {n: self._answer(w) for n, w in self.witnesses.items()}, "max_difference": self.max_difference,
            "relative_difference": self.relative_difference, "notes": list(self.notes), "parameters": dict(self.parameters),
            "status": "answered" if not self.exit_code else "finished, do not trust it", "message": self.message,
            "versions": dict(self.versions), "files": dict(self.files),
        }  # fmt: skip

    def _mode(self, m: VibrationMode) -> dict[str, Any]:
        out: dict[str, Any] = {
            "frequency_hz": m.frequency_hz, "omega": m.omega, "damping": m.damping, "kind": m.kind,
            "error": m.error, "eigenvalues": [[r.real, r.imag] for r in m.eigenvalues], "shape": self.shape(m),
        }  # fmt: skip
        return out | ({"phase": self.phase(m)} if self.phase(m) else {})

    def _answer(self, w: ModesWitness) -> dict[str, Any]:
        if w.cannot:
            return {"cannot": w.cannot}
        return {
            "equilibrium": values_at(self.mechanism, w.q), "residual": w.residual, "omega": [m.omega for m in w.modes],
            "damping": [m.damping for m in w.modes], "kind": [m.kind for m in w.modes],
        }  # fmt: skip


def values_at(m: Mechanism, q: Array) -> dict[str, Any]:
    """Physical values of joints and shafts at coordinates q (nq,)."""
    out: dict[str, Any] = {}
    for joint in m.joints:
        out[joint.name] = (
            q[m.q_slice[joint.name]].tolist() if joint.kind == "spherical" else float(m.value(joint.name, q))
        )
    return out | {s.name: float(m.value(s.name, q)) for s in m.shafts}


def eigenvalue_gaps(a: tuple[VibrationMode, ...], b: tuple[VibrationMode, ...]) -> list[tuple[float, float, float]]:
    """For each mode of a, the eigenvalue difference to the nearest mode of b not yet assigned: absolute [1/s], relative, and relative
    beyond the errors of the two.

    A last entry of infinities stands for unequal numbers of modes.
    """
    left = list(b)
    out: list[tuple[float, float, float]] = []
    none = (float("inf"), float("inf"), float("inf"))
    for mode in sorted(a, key=lambda m: -m.omega):
        if not left:
            return [*out, none]
        mine = sorted(mode.eigenvalues, key=lambda r: (r.real, r.imag))
        gaps = []
        for other in left:
            theirs = sorted(other.eigenvalues, key=lambda r: (r.real, r.imag))
            gaps.append(max(abs(x - y) for x, y in zip(mine, theirs, strict=True)))
        best = int(np.argmin(gaps))
        size = max(abs(r) for r in (*mode.eigenvalues, *left[best].eigenvalues)) or 1.0
        beyond = max(0.0, gaps[best] - mode.error - left[best].error)
        out.append((gaps[best], gaps[best] / size, beyond / size))
        del left[best]
    return out if not left else [*out, none]
