"""The health record of a run: findings with a number, a limit and a sentence. A run that cannot be trusted says so."""

from __future__ import annotations

from dataclasses import dataclass

SEVERITIES = ("ok", "warning", "error")


@dataclass(frozen=True)
class Finding:
    """One finding. severity "ok": within its limit; "warning": to be known; "error": the result must not be trusted."""

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


def measured(name: str, value: float, limit: float, unit: str, what: str, warn: float | None = None) -> Finding:
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
class Health:
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
