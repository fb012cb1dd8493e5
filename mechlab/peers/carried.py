"""What no peer is given: said in a sentence, before anything is built."""

from __future__ import annotations

from importlib.util import find_spec

from mechlab.errors import unknown
from mechlab.experiment.scene import Scene
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import LOOP_ROWS

PEERS = {"exudyn": "exudyn", "drake": "pydrake", "opensim": "opensim"}
"""Peer -> the Python module that it is."""
LOOPS = {
    "exudyn": ("spherical", "revolute", "cylindrical", "prismatic", "fixed"),
    "drake": ("spherical", "revolute", "fixed"),
    "opensim": ("spherical", "revolute", "fixed"),
}
"""Kinds of loop that each peer has a counterpart for."""


def installed(peer: str) -> bool:
    """Whether the peer can be imported here (it is not). Raises MechlabError for an unknown one."""
    if peer not in PEERS:
        raise unknown("peer", peer, PEERS)
    return find_spec(PEERS[peer]) is not None


OPEN_ONLY = {
    "exudyn": ("RK44", "RK67", "DOPRI5"),
    "drake": ("runge_kutta3", "runge_kutta5", "radau3"),
    "opensim": (),
}
"""Integrators that take no loops."""
CONTROLLED = {
    "exudyn": ("DOPRI5",),
    "drake": ("runge_kutta3", "runge_kutta5", "radau3"),
    "opensim": ("RungeKuttaMerson", "RungeKuttaFeldberg", "CPodes"),
}
"""Integrators that choose their own steps, to a tolerance; the others take fixed ones."""
INTEGRATORS = {
    "exudyn": ("generalized-alpha", "trapezoidal", *OPEN_ONLY["exudyn"]),
    "drake": ("SAP", *OPEN_ONLY["drake"]),
    "opensim": CONTROLLED["opensim"],
}


def refusal(peer: str, integrator: str, mechanism: Mechanism, scene: Scene) -> str:
    """Why the peer's integrator cannot be given the scene, as a sentence; empty when it can.

    Raises MechlabError for an unknown peer or integrator, listing those that exist.
    """
    if not installed(peer):
        return f"{peer} is not installed; pip install 'mechlab[peers]'"
    return cannot_carry(peer, integrator, mechanism, scene)


def controlled(peer: str, integrator: str) -> bool:
    """Whether the integrator of a peer chooses its own steps, to a tolerance."""
    return integrator in CONTROLLED[peer]


def cannot_carry(peer: str, integrator: str, mechanism: Mechanism, scene: Scene) -> str:
    """What of the scene has no counterpart in the peer; empty when all has. Looks at the data alone."""
    if integrator not in INTEGRATORS[peer]:
        raise unknown(f"integrator of {peer}", integrator, INTEGRATORS[peer])
    m = mechanism
    for joint in m.joints:
        if joint.nv != 1:
            return f"the {joint.kind} joint {joint.name} is not carried over to peers"
        if joint.friction:
            return f"the dry friction of {joint.name} is not carried over to peers"
        if joint.armature:
            return f"the armature of {joint.name} is not carried over to peers"
    if m.relations:
        return f"the gear relation {m.relations[0].name} is not carried over to peers"
    for shaft in m.shafts:
        if shaft.inertia or shaft.damping or shaft.friction or shaft.stiffness:
            return f"peers have no shafts without coordinates such as {shaft.name}"
    for loop in m.loops:
        assert loop.kind in LOOP_ROWS
        if loop.kind not in LOOPS[peer]:
            return f"the {loop.kind} loop {loop.name} has no counterpart in {peer}"
    if m.loops and integrator in OPEN_ONLY[peer]:
        return f"{peer} closes no loops with {integrator}"
    for law in scene.laws:
        if law.kind != "constant":
            return f"the {law.kind} law on {', '.join(law.targets())} is not carried over to peers, only constant loads"
    return ""
