"""A sweep as one labelled dataset, and as a netCDF file: names, units, provenance, reasons of the gaps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError
from mechlab.files import unfinished
from mechlab.study.sweep.request import METHODS, Axis, Request

if TYPE_CHECKING:
    from mechlab.study.sweep.result import SweepResult

HOW = "pip install 'mechlab[cluster]'"


def need_xarray() -> Any:
    """The package xarray; raises EngineMissing with what to install."""
    try:
        import xarray
    except ModuleNotFoundError as missing:
        raise EngineMissing(f"a dataset needs xarray ({missing.name} is missing): {HOW}.") from None
    return xarray


def dataset(result: SweepResult) -> Any:
    """An xarray.Dataset: a variable for each quantity over the axes, `outcome`, `reason`, and where all this comes from."""
    r = result.request
    dims = tuple(a.key for a in r.axes)
    variables: dict[str, Any] = {}
    for q in r.quantities:
        values = result[q.label]
        told = {"long_name": f"{q.kind} {q.name}" + (f", {q.reduce}" if q.kind == "channel" else "")}
        variables[q.label] = (dims, values, told | ({"units": q.unit} if q.unit else {}))
    meaning = {
        "flag_values": np.array([0, 1, 3, 4], dtype=np.int8),
        "flag_meanings": "good bad_input untrusted no_solution",
    }
    variables["outcome"] = (dims, result.outcome, {"long_name": "how the point went"} | meaning)
    variables["reason"] = (dims, result.reason, {"long_name": "why there is a gap"})
    coords = {a.key: (a.key, a.coordinates, _told(a)) for a in r.axes}
    return need_xarray().Dataset(variables, coords, provenance(r, result.command))


def provenance(request: Request, command: str) -> dict[str, Any]:
    """Attributes that say what was computed, by what, from what."""
    given = request.description()
    return {
        "title": f"sweep of {request.name} over {', '.join(a.key for a in request.axes)}", "mechanism": request.name,
        "command": command, "method": f"{request.method}: {METHODS[request.method]}", "witness": request.witness,
        "scene": request.scene or "", "parameters": json.dumps(given["parameters"]), "given": json.dumps(given["given"]),
        "settings": json.dumps({k: given[k] for k in ("engine", "fidelity", "duration", "timestep") if given[k] is not None}),
        "versions": json.dumps(given["versions"]), "request": json.dumps(given, sort_keys=True), "fingerprint": request.fingerprint,
        "Conventions": "CF-1.11",
    }  # fmt: skip


def _told(axis: Axis) -> dict[str, str]:
    """Attributes of an axis."""
    told = {"long_name": axis.text or axis.key, "role": axis.role}
    return told | ({"units": axis.unit} if axis.unit else {})


def write(result: SweepResult, path: Path) -> Path:
    """Write netCDF-3 (64-bit offset), which every netCDF reader opens; the file is there complete or not at all."""
    with unfinished(path) as temporary:
        result.dataset.to_netcdf(temporary, format="NETCDF3_64BIT", engine="scipy")
    return path


def read(path: Path) -> Any:
    """The dataset of a file, in memory; raises MechlabError for what is no netCDF file."""
    xarray = need_xarray()
    try:
        with xarray.open_dataset(path, engine="scipy") as found:
            return found.load()
    except Exception as cause:  # whatever a damaged file makes the readers of netCDF raise
        words = " ".join(str(cause).split())[:200].rstrip(".") or type(cause).__name__
        raise MechlabError(f"{path} is no netCDF file of a sweep: {words}.") from None


def kept(path: Path, request: Request) -> tuple[np.ndarray, np.ndarray, dict[int, str]] | None:
    """Numbers, outcomes and reasons, in the order of work, of a finished file of the same request; None where there is no
    file. Raises MechlabError where the file holds another sweep, naming what differs."""
    from mechlab.study.sweep.resume import description_in, refuse_another

    if not path.is_file():
        return None
    found = read(path)
    refuse_another(description_in(str(found.attrs.get("request", "{}")), path), request, path)
    order = [a.key for a in request.work]

    def flat(name: str) -> np.ndarray:
        return np.asarray(found[name].transpose(*order).values).ravel()

    try:
        reasons = {int(i): str(text) for i, text in enumerate(flat("reason")) if text}
        values, outcomes = np.column_stack([flat(q.label) for q in request.quantities]).astype(float), flat("outcome")
    except (KeyError, ValueError, TypeError) as cause:
        raise MechlabError(f"{path} is no complete file of a sweep: {cause}.") from None
    if values.shape != (request.count, len(request.quantities)) or outcomes.shape != (request.count,):
        raise MechlabError(f"{path} holds {len(values)} points, expected {request.count}.")
    return values, outcomes, reasons
