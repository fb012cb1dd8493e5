"""Solids for the eye: every kind of shape, built from its parameters as a triangle mesh. Metres and radians."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType

from mechlab.errors import MechlabError, explained, unknown
from mechlab.mechanism import parts
from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.given import Number, si
from mechlab.mechanism.parts import Color, Shape
from mechlab.shapes import bevel, contours, gears, joints, links, simple
from mechlab.shapes.build import Kind, Parameter, Times
from mechlab.shapes.feature_edges import SplitMesh, split_at_edges, split_faces
from mechlab.shapes.obj import obj_text, write_obj
from mechlab.shapes.phases import bevel_phase, external_phase, internal_phase, pitch_angles, rack_phase
from mechlab.shapes.solid import Mesh, bounds, is_watertight, merge, moved, volume
from mechlab.shapes.surface import surface_mesh, surface_text

__all__ = [
    "KINDS", "Kind", "Mesh", "Parameter", "SplitMesh", "Times", "bevel_phase", "bounds", "external_phase",
    "internal_phase", "is_watertight", "merge", "mesh", "moved", "obj_text", "pitch_angles", "rack_phase", "shape",
    "split_at_edges", "split_faces", "surface_mesh", "surface_text", "volume", "write_obj",
]  # fmt: skip

_MODULES = (simple, links, joints, gears, bevel, contours)
KINDS: Mapping[str, Kind] = MappingProxyType({kind.name: kind for module in _MODULES for kind in module.KINDS})

MAX_COUNT = 2000
"""Largest number of teeth, holes, spokes and the like in one solid."""


@explained
def shape(
    kind: str, placement: Placement = IDENTITY, color: Color = (0.62, 0.66, 0.72, 1.0), name: str = "", **size: Number
) -> Shape:
    """A Shape of a kind in KINDS from keyword sizes [m, rad, counts] or text with a unit:
    `shape("cylinder", radius=0.01, length="10mm")`.

    Raises MechlabError that names an unknown kind or size and lists what exists, or a size that is missing or impossible.
    """
    if kind not in KINDS:
        raise unknown("shape kind", kind, KINDS)
    units = {p.name: p.unit for p in KINDS[kind].parameters}
    sizes = {k: si(v, f"{kind}: {k}", u if (u := units.get(k, "")) in ("m", "rad") else "") for k, v in size.items()}
    KINDS[kind].sizes(sizes)
    return parts.shape(kind, placement, color, name, **sizes)


SURFACE = "mesh"
"""Kind of a shape whose surface comes from a file; it has no sizes but data."""


def mesh(kind: str, size: Mapping[str, float], data: str = "") -> Mesh:
    """The solid of a kind: closed, its faces counter-clockwise seen from outside; the same object for the same sizes. Of the kind
    "mesh": the surface in `data`, as it came.

    Raises MechlabError that names an unknown kind or parameter and lists what exists, or says which size is impossible.
    """
    if kind == SURFACE:
        return surface_mesh(data)
    if kind not in KINDS:
        raise unknown("shape kind", kind, [*KINDS, SURFACE])
    return _built(kind, tuple(_drawable(kind, KINDS[kind].sizes(size)).items()))


def _drawable(kind: str, sizes: dict[str, float | int]) -> dict[str, float | int]:
    """Sizes with at most MAX_COUNT teeth, on the same pitch circle. Raises MechlabError for more of anything else."""
    teeth = sizes.get("teeth", 0)
    if teeth > MAX_COUNT and "module" in sizes:
        sizes = sizes | {"teeth": MAX_COUNT, "module": sizes["module"] * (teeth / MAX_COUNT)}
    for p in KINDS[kind].parameters:
        if p.unit == "count" and sizes[p.name] > MAX_COUNT:
            raise MechlabError(f"{kind}: {p.name} must be at most {MAX_COUNT}, got {sizes[p.name]:g}.")
    return sizes


@lru_cache(maxsize=512)
def _built(kind: str, sizes: tuple[tuple[str, float], ...]) -> Mesh:
    return KINDS[kind].build(**dict(sizes))
