"""Files of a sweep: the finished dataset (netCDF), and the finished blocks of one that was interrupted.

FILE.nc.parts/ holds request.json, the description of the request, and files of finished blocks, each written whole or not at all.
"""

from __future__ import annotations

import io
import json
import shutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.files import unfinished, write
from mechlab.formats.json_text import parse
from mechlab.studies.sweep.request import SweepBlock, SweepRequest
from mechlab.studies.sweep.result import SweepResult, need_xarray

EVERY = 2.0
"""Seconds between two writes of finished blocks; the rest is written when the sweep ends, unless the process is
killed."""


class Parts:
    """The folder with the finished blocks of one sweep. `finished`: index -> block."""

    def __init__(self, folder: Path, request: SweepRequest, resume: bool) -> None:
        """Raises MechlabError where the folder holds another sweep, or this one and `resume` is False."""
        self.folder, self.request = folder, request
        self.finished: dict[int, SweepBlock] = {}
        self._waiting: dict[int, SweepBlock] = {}
        self._last = time.monotonic()
        kept = folder / "request.json"
        if not kept.is_file():
            return
        if not resume:
            raise MechlabError(
                f"{folder} holds what an interrupted sweep has finished: say --resume to go on, or remove the folder to start anew."
            )
        refuse_another(description_in(kept.read_bytes(), kept), request, folder)
        for file in sorted(folder.glob("blocks-*.npz")):
            self.finished |= _read(file, request)

    def add(self, index: int, block: SweepBlock) -> None:
        """Keep a finished block."""
        self._waiting[index] = block
        if time.monotonic() - self._last > EVERY:
            self.write()

    def write(self) -> None:
        """Write the blocks that are not written yet."""
        self._last = time.monotonic()
        if not self._waiting:
            return
        kept = self.folder / "request.json"
        if not kept.is_file():
            write(kept, json.dumps(self.request.description(), indent=1))
        arrays: dict[str, Any] = {"indices": np.array(sorted(self._waiting))}
        for k, block in self._waiting.items():
            reasons = json.dumps({str(i): text for i, text in block.reasons.items()}).encode()
            arrays |= {f"values{k}": block.values, f"outcomes{k}": block.outcomes}
            arrays[f"reasons{k}"] = np.frombuffer(reasons, dtype=np.uint8)
        content = io.BytesIO()
        np.savez(content, **arrays)
        write(self.folder / f"blocks-{min(self._waiting):08d}-{len(self._waiting)}.npz", content.getvalue())
        self._waiting.clear()

    def remove(self) -> None:
        """Delete the folder; for a sweep whose dataset is written."""
        self._waiting.clear()
        if (self.folder / "request.json").is_file():
            shutil.rmtree(self.folder)


def refuse_another(kept: Mapping[str, Any], request: SweepRequest, where: Path) -> None:
    """Raises MechlabError, naming what differs, where `kept` is the description of another request."""
    wanted = json.loads(json.dumps(request.description()))
    differ = [k for k in {*kept, *wanted} if kept.get(k) != wanted.get(k)]
    if not differ:
        return
    inner = []
    for k in sorted(differ):
        was, now = kept.get(k), wanted.get(k)
        if isinstance(was, dict) and isinstance(now, dict):
            inner += [f"{k} {x}" for x in sorted({*was, *now}) if was.get(x) != now.get(x)]
        else:
            inner.append(k)
    raise MechlabError(
        f"{where} holds another sweep: {', '.join(inner)} differ. Ask for the same, or remove it, or choose another file."
    )


def description_in(content: str | bytes, where: Path) -> dict[str, Any]:
    """The description of a request from its JSON; raises MechlabError, naming the file, for other content."""
    try:
        text = content if isinstance(content, str) else content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise MechlabError(f"{where} does not say what was wanted: {error}.") from None
    return parse(text, str(where), finite=False)


def _read(file: Path, request: SweepRequest) -> dict[int, SweepBlock]:
    """The finished blocks of a file; raises MechlabError for a file that is damaged or has blocks of another size."""
    try:
        with file.open("rb") as raw, np.load(raw, allow_pickle=False) as arrays:
            return {int(k): _block(arrays, int(k), request) for k in arrays["indices"].tolist()}
    except MechlabError as error:
        words = str(error).rstrip(".")
    except Exception as error:  # whatever a damaged file makes the readers of zip and npy raise
        words = " ".join(str(error).split())[:200].rstrip(".") or type(error).__name__
    raise MechlabError(f"{file} is damaged: {words}. Remove it: its points are then computed again.")


def _block(arrays: Any, k: int, request: SweepRequest) -> SweepBlock:
    if not 0 <= k < request.blocks:
        raise MechlabError(f"block {k} of {request.blocks}")
    start, stop = request.span(k)
    values, outcomes = arrays[f"values{k}"], arrays[f"outcomes{k}"]
    if values.shape != (stop - start, len(request.quantities)) or outcomes.shape != (stop - start,):
        raise MechlabError(f"block {k} has the shapes {values.shape} and {outcomes.shape}")
    if values.dtype != np.float64 or outcomes.dtype != np.int8:
        raise MechlabError(f"block {k} holds {values.dtype} and {outcomes.dtype}")
    reasons = parse(arrays[f"reasons{k}"].tobytes().decode(), f"block {k}: reasons")
    return SweepBlock(values, outcomes, {int(i): str(text) for i, text in reasons.items()})


def write_dataset(result: SweepResult, path: Path) -> Path:
    """Write netCDF-3 (64-bit offset), which every netCDF reader opens. An error leaves no incomplete file."""
    with unfinished(path) as temporary:
        result.dataset.to_netcdf(temporary, format="NETCDF3_64BIT", engine="scipy")
    return path


def read_dataset(path: Path) -> Any:
    """The dataset of a file, loaded into memory; raises MechlabError for a file that is not netCDF."""
    xarray = need_xarray()
    try:
        with xarray.open_dataset(path, engine="scipy") as found:
            return found.load()
    except Exception as cause:  # whatever a damaged file makes the readers of netCDF raise
        words = " ".join(str(cause).split())[:200].rstrip(".") or type(cause).__name__
        raise MechlabError(f"{path} is no netCDF file of a sweep: {words}.") from None


def kept_dataset(path: Path, request: SweepRequest) -> tuple[np.ndarray, np.ndarray, dict[int, str]] | None:
    """Numbers, outcomes and reasons, in the order of work, of a finished file of the same request; None where there is no
    file. Raises MechlabError where the file holds another sweep, naming what differs."""

    if not path.is_file():
        return None
    found = read_dataset(path)
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
