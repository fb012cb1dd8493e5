"""What a part looks like: a kind of solid and its parameters. The meshes themselves are made in `mechlab.shapes`."""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.mechanism.geometry import IDENTITY, Placement

Color = tuple[float, float, float, float]


@dataclass(frozen=True)
class Shape:
    """A solid of `kind` (see `mechlab.shapes.KINDS`) with named `size` parameters [m, rad, counts], placed in its body.

    Shapes carry no mass: inertia is given separately, so that a picture never changes the physics.
    """

    kind: str
    size: tuple[tuple[str, float], ...] = ()
    placement: Placement = IDENTITY
    color: Color = (0.62, 0.66, 0.72, 1.0)
    name: str = ""

    @property
    def parameters(self) -> dict[str, float]:
        """The size parameters as a dict."""
        return dict(self.size)


def shape(
    kind: str, placement: Placement = IDENTITY, color: Color = (0.62, 0.66, 0.72, 1.0), name: str = "", **size: float
) -> Shape:
    """A Shape from keyword sizes: `shape("cylinder", radius=0.01, length=0.1)`."""
    return Shape(kind, tuple(sorted((k, float(v)) for k, v in size.items())), placement, color, name)
