"""Files for other tools, beside the usual four: a ROS 2 package, SDF, an Extended URDF, parts for a printer, USD."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from mechlab.errors import unknown
from mechlab.formats.exports.extended_urdf import ExtendedUrdf, to_extended_urdf, write_extended_urdf
from mechlab.formats.exports.graph import Exported
from mechlab.formats.exports.parts import write_3mf, write_stl
from mechlab.formats.exports.ros2 import write_ros2
from mechlab.formats.exports.sdf import sdf_left_out, to_sdf, write_sdf
from mechlab.formats.exports.usd import to_usd, write_usd
from mechlab.mechanism.model import Mechanism

EXPORTS: Mapping[str, Callable[[Mechanism, Path], Exported]] = MappingProxyType(
    {
        "ros2": write_ros2, "sdf": write_sdf, "extended-urdf": write_extended_urdf, "stl": write_stl, "3mf": write_3mf, "usd": write_usd,
    }  # fmt: skip
)
"""Name -> what writes the files into a folder that exists."""


def chosen(also: Sequence[str]) -> tuple[str, ...]:
    """The names of exports, "a,b" or a list, each once; raises MechlabError that lists what exists."""
    names = also.split(",") if isinstance(also, str) else also
    names = [n.strip() for n in names if n.strip()]
    for name in names:
        if name not in EXPORTS:
            raise unknown("generate: also", name, EXPORTS)
    return tuple(dict.fromkeys(names))


__all__ = [
    "EXPORTS", "Exported", "ExtendedUrdf", "chosen", "sdf_left_out", "to_extended_urdf", "to_sdf", "to_usd", "write_3mf",
    "write_extended_urdf", "write_ros2", "write_sdf", "write_stl",
    "write_usd",
]  # fmt: skip
