"""A diagnosis as data: findings with a sentence and a text to paste, the structure, the gap, the settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mechlab.mechanism.structure import FREEDOMS, Redundancy
from mechlab.tables import Told, counted, number

ORDER = {"error": 0, "warning": 1, "note": 2}
"""Severities: "error": results of the file as it is cannot be trusted; "warning": to be known; "note": for other tools."""
SHOWN = 12


@dataclass(frozen=True)
class Symptom:
    """One finding: a name, its severity, a sentence with the numbers, and what to paste into the file ("" for nothing)."""

    name: str
    severity: str
    sentence: str
    paste: str = ""

    def to_dict(self) -> dict[str, str]:
        """JSON-able form."""
        return {"name": self.name, "severity": self.severity, "sentence": self.sentence, "paste": self.paste}


@dataclass(frozen=True)
class Diagnosis(Told):
    """The diagnosis of a file. `freedoms` is None where no rank could be taken; `gap` [m, rad] is the largest residual of
    a loop or coupling in the reference pose, None where nothing closes; `paste` the whole of the recommended settings."""

    name: str
    kind: str
    coordinates: int | None
    rows: int | None
    freedoms: int | None
    idle: tuple[str, ...]
    redundant: tuple[Redundancy, ...]
    gap: float | None
    findings: tuple[Symptom, ...]
    paste: str = ""
    notes: tuple[str, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def exit_code(self) -> int:
        """3 when a finding is an error, else 0."""
        return 3 if any(f.severity == "error" for f in self.findings) else 0

    @property
    def message(self) -> str:
        """One sentence: what must not be trusted, or that nothing serious was found."""
        bad = [f.sentence for f in self.findings if f.severity == "error"]
        if bad:
            return f"{self.name}: do not trust results of this file as it is: {' '.join(bad)}"
        warned = sum(f.severity == "warning" for f in self.findings)
        return f"{self.name}: nothing serious" + (f"; {warned} to be known" if warned else "")

    def finding(self, name: str) -> Symptom:
        """The first finding of that name; raises KeyError."""
        for f in self.findings:
            if f.name == name:
                return f
        raise KeyError(name)

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "file": self.name, "kind": self.kind, "coordinates": self.coordinates, "rows": self.rows, "freedoms": self.freedoms,
            "local_freedoms": list(self.idle), "redundant": [x.sentence for x in self.redundant], "gap": self.gap,
            "findings": [f.to_dict() for f in self.findings], "paste": self.paste, "notes": list(self.notes),
            "versions": dict(self.versions), "message": self.message,
        }  # fmt: skip

    def text(self) -> str:
        """The structure, the findings by severity, the text to paste."""
        lines = [f"{self.name} ({self.kind})"]
        if self.freedoms is not None:
            lines.append(
                f"  {counted(self.coordinates or 0, 'coordinate')}, {counted(self.rows or 0, 'constraint row')}: "
                f"{counted(self.freedoms, *FREEDOMS)}"
            )
        if self.idle:
            lines.append(f"  local freedoms: {', '.join(self.idle)}")
        if self.redundant:
            lines.append(f"  {len(self.redundant)} redundant rows:")
            lines += [f"    {x.sentence}" for x in self.redundant[:SHOWN]]
            if len(self.redundant) > SHOWN:
                lines.append(f"    and {len(self.redundant) - SHOWN} more (--json lists all)")
        if self.gap is not None:
            lines.append(f"  largest gap in the reference pose: {number(self.gap)} m or rad")
        lines += ["", "findings" if self.findings else "no findings"]
        for f in self.findings:
            lines.append(f"  {f.severity:8s}{f.name}: {f.sentence}")
            lines += [f"          {row}" for row in f.paste.splitlines()]
        lines += [f"  note    {n}" for n in self.notes]
        if self.paste:
            lines += ["", "to paste", *(f"  {row}" for row in self.paste.splitlines())]
        lines += [
            "",
            self.message if self.exit_code == 0 else f"{self.name}: do not trust results of this file as it is.",
        ]
        return "\n".join(lines)
