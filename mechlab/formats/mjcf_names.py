"""Names in an MJCF file. What mechlab adds carries a ':', which no name of a Mechanism may have: nothing collides."""

from __future__ import annotations

from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND

BASE = "base"
"""The one fixed body around everything (some readers of MJCF keep only the first child of the world)."""


def body_name(name: str) -> str:
    """MJCF name of a body: its own, but `base` for the ground; bodies called base or world get a suffix."""
    if name == GROUND:
        return BASE
    return f"{name}:body" if name in (BASE, "world") else name


def site_names(loop: str) -> tuple[str, str]:
    """Sites at the ends a and b of a loop or spring."""
    return f"{loop}:a", f"{loop}:b"


def axis_site_names(loop: str) -> tuple[str, str]:
    """Second pair of sites of a revolute loop, along its axis."""
    return f"{loop}:axis_a", f"{loop}:axis_b"


def axis_name(loop: str) -> str:
    """Second connect of a revolute loop."""
    return f"{loop}:axis"


def connector_name(loop: str) -> str:
    """Connector body of a universal, cylindrical or prismatic loop; its joints are NAME:1, NAME:2."""
    return f"{loop}:connector"


def connector_joint(loop: str, number: int) -> str:
    """Joint 1 or 2 of a connector body."""
    return f"{loop}:{number}"


def tendon_name(mechanism: Mechanism, name: str) -> str:
    """Tendon of a relation, spring or distance loop: its name, with a suffix when a shaft is called the same."""
    return f"{name}:tendon" if any(s.name == name for s in mechanism.shafts) else name


def stage_name(body: str, number: int) -> str:
    """Body that carries the first joints of another one, where MuJoCo does not allow all of them in one body."""
    return f"{body}:stage{number}"
