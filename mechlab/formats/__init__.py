"""Mechanisms as files and back: JSON (exact), MJCF, URDF with a sidecar, recordings as .npz. No engine is imported."""

from typing import TYPE_CHECKING

from mechlab.on_demand import on_demand

if TYPE_CHECKING:
    from mechlab.formats.mechanism_json import from_json, to_json
    from mechlab.formats.mjcf.read import from_mjcf
    from mechlab.formats.mjcf.write import scene_mjcf, to_mjcf
    from mechlab.formats.recording_npz import load_recording, save_recording
    from mechlab.formats.urdf import to_urdf, urdf_map
    from mechlab.formats.urdf_file import from_urdf, read_urdf
    from mechlab.formats.write import write_files

_HOMES = {
    "mechanism_json": ("from_json", "to_json"),
    "mjcf.read": ("from_mjcf",),
    "mjcf.write": ("scene_mjcf", "to_mjcf"),
    "recording_npz": ("load_recording", "save_recording"),
    "urdf": ("to_urdf", "urdf_map"),
    "urdf_file": ("from_urdf", "read_urdf"),
    "write": ("write_files",),
}
__getattr__ = on_demand(__name__, _HOMES)

__all__ = [
    "from_json", "from_mjcf", "from_urdf", "load_recording", "read_urdf", "save_recording", "scene_mjcf",
    "to_json", "to_mjcf", "to_urdf", "urdf_map", "write_files",
]  # fmt: skip
