"""Runs a sweep: a scheduler computes the blocks in any order, files keep them, and they are joined to one result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from mechlab.errors import MechlabError
from mechlab.studies.sweep.files import Parts, kept_dataset, write_dataset
from mechlab.studies.sweep.picture import draw, refuse
from mechlab.studies.sweep.request import SweepBlock, SweepRequest
from mechlab.studies.sweep.result import SweepResult, need_xarray
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
        refuse(len(request.axes), len(request.quantities), plot)
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
    """The result with its files written."""
    files: dict[str, Path] = {}
    if out is not None:
        if write:
            write_dataset(result, out)
        files["dataset"] = out
    if plot is not None:
        files["picture"] = draw(result, plot)
    return replace(result, files=files)
