"""Published computing times of the benchmark problems, as printed, with the machine they were taken on."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Published:
    """Program, machine, CPU seconds; the sources print no trajectory error beside the time."""

    program: str
    machine: str
    cpu_s: float

    def to_dict(self) -> dict[str, object]:
        """JSON-able form."""
        return {"program": self.program, "machine": self.machine, "cpu_s": self.cpu_s}


_OPENSIM = ("OpenSim 3.2 / Simbody (2015)", "i5-4570, 3.2 GHz")

PUBLISHED: dict[str, tuple[Published, ...]] = {
    "pendulum": (Published(*_OPENSIM, 0.637),),
    "n_fourbar": (Published(*_OPENSIM, 0.455),),
    "andrews": (Published(*_OPENSIM, 0.384),),
    "bricard": (Published(*_OPENSIM, 0.258),),
    "flyball": (Published(*_OPENSIM, 0.233),),
}
"""MBSbenchmarksInOpenSim (RehabEngGroup), with the parameters of the IFToMM library."""
