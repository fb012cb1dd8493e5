"""Runs a sweep: a scheduler computes the blocks in any order, a folder keeps those that are finished, and they are joined to
one result.

FILE.nc.parts/ holds request.json, the description of the request, and files of finished blocks, each written whole or not at all.
"""

from __future__ import annotations

import io
import json
import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.errors import MechlabError
from mechlab.files import write
from mechlab.formats.json_text import parse
from mechlab.studies.sweep.precision import single_precision
from mechlab.studies.sweep.report import draw, refuse_picture
from mechlab.studies.sweep.request import SweepBlock, SweepRequest
from mechlab.studies.sweep.result import (
    SweepResult,
    description_in,
    kept_dataset,
    need_xarray,
    refuse_another,
    write_dataset,
)
from mechlab.studies.sweep.schedulers import run_on_cluster, run_on_cores

SUFFIX = ".nc"


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep; its text says how many points are finished and whether they are kept."""


def sweep(
    request: SweepRequest,
    *,
    out: Path | None = None,
    plot: Path | None = None,
    resume: bool = False,
    scheduler: str | None = None,
    workers: int | None = None,
    command: str = "",
    warnings: tuple[str, ...] = (),
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> SweepResult:
    """Compute a request. out: a netCDF file; plot: a picture of one or two axes; resume: continue an interrupted sweep
    into the same file; scheduler: address of a Dask cluster; workers: number of processes on this machine.

    Raises MechlabError for files of another sweep, and where every point is bad input. A sweep without any solution is
    a result with exit code 4, not an exception.
    """
    if resume and out is None:
        raise MechlabError("--resume needs the file that the interrupted sweep was for: -o FILE.nc.")
    if scheduler is not None and workers is not None:
        raise MechlabError(
            "--workers counts processes on this machine, and --scheduler computes on a cluster: leave out one."
        )
    if plot is not None:
        refuse_picture(len(request.axes), len(request.quantities), plot)
    parts: Parts | None = None
    if out is not None:
        if out.suffix != SUFFIX:
            raise MechlabError(f"-o {out}: expected a file name that ends in {SUFFIX}.")
        need_xarray()
        parts = Parts(out.with_name(f"{out.name}.parts"), request, resume)
        if resume and not parts.finished and (before := kept_dataset(out, request)) is not None:
            return _finished(SweepResult(request, *before, 0, command, warnings=warnings), out, plot, write=False)
    flat = np.full((request.count, len(request.quantities)), np.nan)
    outcomes = np.zeros(request.count, dtype=np.int8)
    reasons: dict[int, str] = {}
    done = 0

    def take(index: int, block: SweepBlock) -> int:
        start, stop = request.span(index)
        flat[start:stop], outcomes[start:stop] = block.values, block.outcomes
        reasons.update({start + i: text for i, text in block.reasons.items()})
        return stop - start

    before_now = parts.finished if parts is not None else {}
    for index, block in before_now.items():
        done += take(index, block)
    kept_points = done
    progress(done, request.count)
    left = [k for k in range(request.blocks) if k not in before_now]
    try:
        blocks = run_on_cores(request, left, workers) if scheduler is None else run_on_cluster(request, left, scheduler)
        for index, block in blocks if left else ():
            done += take(index, block)
            if parts is not None:
                parts.add(index, block)
            progress(done, request.count)
    except KeyboardInterrupt:
        if parts is None:
            raise Interrupted(
                f"{done} of {request.count} points were finished; with -o FILE.nc they would be kept"
            ) from None
        parts.write()
        if not done:
            raise Interrupted(f"none of {request.count} points was finished, nothing is kept") from None
        raise Interrupted(
            f"{done} of {request.count} points are kept in {parts.folder}; --resume goes on from there"
        ) from None
    except BaseException:
        if parts is not None:
            parts.write()
        raise
    reasons = dict(sorted(reasons.items()))
    result = SweepResult(request, flat, outcomes, reasons, request.count - kept_points, command, warnings=warnings)
    if result.exit_code == 1:
        raise MechlabError(
            f"{request.name}: no point of the sweep could be computed: {next(iter(reasons.values()), '')}"
        )
    finished = _finished(result, out, plot)
    if parts is not None:
        parts.remove()
    return finished


def _finished(result: SweepResult, out: Path | None, plot: Path | None, write: bool = True) -> SweepResult:
    """The result with the errors of single precision, and its files written."""
    if result.request.backend == "warp":
        errors, doubts = single_precision(result.request, result.flat, result.outcomes)
        result = replace(result, errors=errors, warnings=(*result.warnings, *doubts))
    files: dict[str, Path] = {}
    if out is not None:
        if write:
            write_dataset(result, out)
        files["dataset"] = out
    if plot is not None:
        files["picture"] = draw(result, plot)
    return replace(result, files=files)


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
