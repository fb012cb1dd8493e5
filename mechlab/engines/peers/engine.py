"""The peers as engines: which there are, what of a scene they cannot express, and their traces for charts, each made in a process
of its own."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec

import numpy as np

from mechlab.engines.peers.exudyn_planar import why_not_planar
from mechlab.engines.peers.job import job_of, links_of
from mechlab.engines.peers.process import PeerFailed, process
from mechlab.engines.protocol import Engine
from mechlab.errors import MechlabError, install_extra, unknown
from mechlab.experiment.laws import Law
from mechlab.experiment.prices import OWN_EQUATIONS, Price
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import Scene, Settings
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import LOOP_ROWS

PEERS = {
    "exudyn": "exudyn", "drake": "pydrake", "opensim": "opensim", "mujoco_warp": "mujoco_warp", "newton": "newton",
}  # fmt: skip
"""Peer -> the Python module to import."""
CAUTIONS = {
    "mujoco_warp": "mujoco-warp computes in single precision (float32), for many worlds at once; its loops are hard (solref 2h)",
    "newton": "Kamino (Newton, beta) computes in single precision (float32); it drops joint equalities (gears, mimic) without a word",
}
"""What a reader of its numbers must know of a peer."""
LOOPS = {
    "exudyn": ("spherical", "revolute", "cylindrical", "prismatic", "fixed"),
    "drake": ("spherical", "revolute", "fixed"),
    "opensim": ("spherical", "revolute", "fixed"),
    "mujoco_warp": ("spherical", "revolute", "fixed"),
    "newton": ("spherical", "revolute", "fixed"),
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
    "mujoco_warp": (),
    "newton": (),
}
"""Integrators that take no loops."""
CONTROLLED = {
    "exudyn": ("DOPRI5",),
    "drake": ("runge_kutta3", "runge_kutta5", "radau3"),
    "opensim": ("RungeKutta3", "RungeKuttaMerson", "RungeKuttaFeldberg", "CPodes"),
    "mujoco_warp": (),
    "newton": (),
}
"""Integrators that choose their own steps, to a tolerance; the others take fixed ones."""
INTEGRATORS = {
    "exudyn": (
        *(f"{rule}{bodies}{newton}" for rule in ("generalized-alpha", "trapezoidal") for bodies in ("", ", planar bodies")
          for newton in ("", ", full Newton")),
        *OPEN_ONLY["exudyn"],
    ),
    "drake": ("SAP", *OPEN_ONLY["drake"]),
    "opensim": CONTROLLED["opensim"],
    "mujoco_warp": ("RK4", "implicitfast"),
    "newton": ("LOX", "DVI"),
}  # fmt: skip


def refusal(peer: str, integrator: str, mechanism: Mechanism, scene: Scene) -> str:
    """Why the peer's integrator cannot be given the scene, as a sentence; empty when it can.

    Raises MechlabError for an unknown peer or integrator, listing those that exist.
    """
    if not installed(peer):
        return f"{peer} is not installed; {install_extra('peers')}"
    return not_expressible(peer, integrator, mechanism, scene)


def controlled(peer: str, integrator: str) -> bool:
    """Whether the integrator of a peer chooses its own steps, to a tolerance."""
    return integrator in CONTROLLED[peer]


def not_expressible(peer: str, integrator: str, mechanism: Mechanism, scene: Scene) -> str:
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
    if m.relations and peer == "newton":
        return f"Kamino drops joint equalities without a word, so that the gear relation {m.relations[0].name} would not hold"
    if m.relations:
        return f"the gear relation {m.relations[0].name} is not carried over to peers"
    if m.curves:
        return f"the curve {m.curves[0].name} is not carried over to peers"
    if peer == "newton":
        for name in [s.name for s in m.springs] + [j.name for j in m.joints if j.stiffness or j.damping]:
            return f"the spring or damper of {name} has no counterpart in Kamino"
    for shaft in m.shafts:
        if shaft.inertia or shaft.damping or shaft.friction or shaft.stiffness:
            return f"peers have no shafts without coordinates such as {shaft.name}"
    for loop in m.loops:
        assert loop.kind in LOOP_ROWS
        if loop.kind not in LOOPS[peer]:
            return f"the {loop.kind} loop {loop.name} has no counterpart in {peer}"
    if "planar bodies" in integrator:
        why = why_not_planar(m, links_of(m))
        if why:
            return why
    if m.loops and integrator in OPEN_ONLY[peer]:
        return f"{peer} closes no loops with {integrator}"
    for law in scene.laws:
        if law.kind != "constant":
            return f"the {law.kind} law on {', '.join(law.targets())} is not carried over to peers, only constant loads"
    return ""


LIMIT = 4.0
"""CPU time that a run may take, unless told otherwise [s]."""


def trace(mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int, limit: float = LIMIT) -> Trace:
    """A scene at `outputs` + 1 even times by the peer `settings.engine`: fixed steps that divide their distance, or the
    tolerance of the settings for integrators with step control (`controlled`).

    A run that fails ends early, with the reason. Raises MechlabError for what the peer cannot be given, PeerStopped when
    the run takes more than `limit` seconds of CPU.
    """
    peer = settings.engine
    why = refusal(peer, settings.integrator, mechanism, scene)
    if why:
        raise MechlabError(f"{mechanism.name}: {why}.")
    value = settings.tolerance if controlled(peer, settings.integrator) else settings.timestep
    job = job_of(mechanism, scene, outputs, settings.integrator, value)
    if peer == "mujoco_warp":
        hard = Settings(integrator=settings.integrator, timestep=value)
        job = replace(job, mjcf=to_mjcf(job.mechanism, hard))
    try:
        found = process(peer).ask(job, limit)
    except PeerFailed as failed:
        return Trace(job.q[None, :], job.v[None, :], np.nan, 0, str(failed))
    assert isinstance(found, Trace)
    return found


class Peer(Engine):
    """One of PEERS."""

    def __init__(self, name: str) -> None:
        self.name = name

    def missing(self) -> str:
        """See `Engine`."""
        return "" if installed(self.name) else f"{self.name} is not installed; {install_extra('peers')}"

    def trace(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int, constraints: str = "", friction: str = ""
    ) -> Trace:  # fmt: skip
        """See `trace`."""
        return trace(mechanism, scene, settings, outputs)

    def refuses(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, constraints: str = "", friction: str = ""
    ) -> str:
        """What of the scene has no counterpart in the peer."""
        return not_expressible(self.name, settings.integrator, mechanism, scene)

    def price(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> Price:
        """The work of a peer is not counted; its budget is that of the lab's own equations."""
        return Price(OWN_EQUATIONS)


ENGINES = {name: Peer(name) for name in PEERS}
