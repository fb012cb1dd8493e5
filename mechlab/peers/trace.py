"""Timed runs of a peer, in a process of its own: a crash is a reason, not an end."""

from __future__ import annotations

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.experiment.trace import Trace
from mechlab.mechanism.model import Mechanism
from mechlab.peers.carried import controlled, refusal
from mechlab.peers.job import job_of
from mechlab.peers.process import PeerFailed, process

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
    try:
        found = process(peer).ask(job, limit)
    except PeerFailed as failed:
        return Trace(job.q[None, :], job.v[None, :], np.nan, 0, str(failed))
    assert isinstance(found, Trace)
    return found
