"""Recordings as .npz: arrays, and a JSON header with mechanism, settings, health, units and versions."""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.health import Finding, Health
from mechlab.experiment.recording import Cost, Recording
from mechlab.experiment.settings import Settings
from mechlab.formats.mechanism_json import from_json, to_json
from mechlab.mechanism.geometry import Array


def save_recording(recording: Recording, path: str | Path) -> Path:
    """Write a recording to `path`, whole or not at all; raises MechlabError when that is not possible."""
    path = Path(path)
    header = {
        "schema": 1, "name": recording.name, "scene": recording.scene, "fidelity": recording.fidelity,
        "parameters": recording.parameters, "settings": asdict(recording.settings), "versions": recording.versions,
        "cost": asdict(recording.cost), "units": recording.units, "errors": recording.errors, "channels": list(recording.channels),
        "acts": recording.acts,
        "health": [f.to_dict() for f in recording.health.findings],
        "mechanism": json.loads(to_json(recording.mechanism)),
    }  # fmt: skip
    arrays = {"t": recording.t, "q": recording.q, "v": recording.v}
    arrays["channels"] = np.array([recording.channels[k] for k in recording.channels]).reshape(
        len(recording.channels), len(recording.t)
    )
    write_npz(path, json.dumps(header, default=str), arrays)
    return path


def write_npz(path: Path, header: str, arrays: Mapping[str, Array]) -> None:
    """An .npz that is the same byte for byte for the same content, written whole or not at all."""
    temporary = path.with_name(path.name + ".part")
    try:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, array in {"header": np.array(header), **arrays}.items():
                buffer = io.BytesIO()
                np.lib.format.write_array(buffer, np.asarray(array), allow_pickle=False)
                archive.writestr(zipfile.ZipInfo(f"{name}.npy"), buffer.getvalue(), zipfile.ZIP_DEFLATED)
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise MechlabError(f"cannot write {path}: {error.strerror or error}.") from None


def load_recording(path: str | Path) -> Recording:
    """Read a recording; raises MechlabError when the file is none."""
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as data:
            header = json.loads(str(data["header"]))
            arrays = {k: data[k] for k in ("t", "q", "v", "channels")}
    except (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise MechlabError(f"{path} is not a recording of mechlab: {error}.") from None
    return Recording(
        mechanism=from_json(json.dumps(header["mechanism"])),
        t=arrays["t"], q=arrays["q"], v=arrays["v"],
        channels=dict(zip(header["channels"], arrays["channels"], strict=True)), units=header["units"],
        errors=header.get("errors", {}),
        health=Health(tuple(Finding(**f) for f in header["health"])),
        cost=Cost(**header["cost"]), settings=Settings(**header["settings"]), scene=header["scene"],
        name=header["name"], fidelity=header["fidelity"], parameters=header["parameters"], versions=header["versions"],
        acts=header.get("acts", ""),
    )  # fmt: skip
