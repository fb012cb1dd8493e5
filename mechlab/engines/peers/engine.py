"""The peers as engines: traces for charts, each made in a process of its own."""

from __future__ import annotations

from mechlab.engines.peers.links import PEERS, installed, not_expressible
from mechlab.engines.peers.process import trace
from mechlab.engines.protocol import Engine
from mechlab.errors import install_extra
from mechlab.experiment.laws import Law
from mechlab.experiment.prices import OWN_EQUATIONS, Price
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism.model import Mechanism


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
        """See `mechlab.engines.peers.process.trace`."""
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
