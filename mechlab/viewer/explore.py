"""What a page needs to be moved by hand, beside the model that it solves itself."""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.errors import MechlabError
from mechlab.mechanism import Mechanism, structure
from mechlab.viewer.reach import BorderSurface


@dataclass(frozen=True, eq=False)
class Exploration:
    """drives: joints and shafts that the page moves by sliders; reach: surface of the region that a point can reach."""

    drives: tuple[str, ...]
    reach: BorderSurface | None = None


def explore(mechanism: Mechanism, reach: BorderSurface | None = None) -> Exploration:
    """The drives of a mechanism, else its independent joints and shafts. Raises MechlabError when nothing can be moved."""
    free = structure(mechanism).independent
    drives = tuple(n for n in dict.fromkeys(d.on for d in mechanism.drives) if n in free)
    drives = drives or tuple(n for n in free if n in mechanism.scalar_names)
    if not drives:
        raise MechlabError(f"{mechanism.name}: it has no drive, joint or shaft that could be moved in the page.")
    return Exploration(drives, reach)
