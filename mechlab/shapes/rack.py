"""The toothed bar that a spur gear rolls on."""

from __future__ import annotations

from mechlab.shapes.build import extrude
from mechlab.shapes.gears import TOOTHED
from mechlab.shapes.kind import Kind, Parameter, Times, count, length
from mechlab.shapes.outlines import rack_outline
from mechlab.shapes.solid import Mesh


def rack(
    teeth: int, module: float, width: float, height: float, pressure_angle: float, backlash: float, phase: float
) -> Mesh:
    """A toothed bar along x with its teeth towards +y, centred in z."""
    outline = rack_outline(teeth, module, height, pressure_angle, backlash, phase)
    return extrude(outline, (), -0.5 * width, 0.5 * width)


KINDS = (
    Kind(
        "rack",
        "toothed bar along x, teeth to +y, pitch line y = 0, centred in z",
        rack,
        (
            count("teeth", "number of teeth", low=1),
            length("module", "pitch over pi"),
            length("width", "width along z"),
            length("height", "bar below the tooth roots", Times(2.0, "module")),
            *TOOTHED,
            Parameter("phase", "pitch", "x of a tooth centre; with 0 an odd number of teeth is centred", 0.0),
        ),
    ),
)
