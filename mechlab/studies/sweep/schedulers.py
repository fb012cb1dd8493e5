"""Schedulers of blocks: this process while little work is left, else a pool of processes; or a Dask cluster."""

from __future__ import annotations

import pickle
import time
from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache, partial
from typing import Any

from mechlab.errors import EngineMissing, MechlabError, install_extra
from mechlab.lab.single_run import versions
from mechlab.processes import cores, in_processes
from mechlab.studies.sweep.evaluate import evaluate
from mechlab.studies.sweep.request import ANSWERS, RUNS, SweepBlock, SweepRequest

WORTH_IT = 4.0
"""Remaining work [s] above which a pool of processes pays: it takes a second or two to start."""

def run_on_cores(
    request: SweepRequest, blocks: Sequence[int], workers: int | None = None
) -> Iterator[tuple[int, SweepBlock]]:
    """Yield (index, block) as blocks are finished. workers: number of processes, default one for each core; 1: no pool.

    Rollouts use the engine's own threads; questions and runs point by point use processes. When the pool breaks
    (a worker was killed), the remaining blocks are computed in this process.
    """
    if workers is not None and workers < 1:
        raise MechlabError(f"workers: expected a whole number >= 1, got {workers}.")
    many = cores() if workers is None else workers
    left = list(blocks)
    began = time.monotonic()
    pooled = many > 1 and request.method in (ANSWERS, RUNS)
    while left:
        block = left.pop(0)
        yield block, evaluate(request, block, many)
        done = len(blocks) - len(left)
        expected = (time.monotonic() - began) / done * len(left)
        if pooled and expected > WORTH_IT and _travels(request):
            break
    if not left:
        return
    lost = set(left)
    try:
        for block, found in in_processes(partial(evaluate, request), left, many):
            lost.discard(block)
            yield block, found
    except BrokenProcessPool:
        for block in sorted(lost):
            yield block, evaluate(request, block, many)


def _travels(request: SweepRequest) -> bool:
    """True when the request can be pickled for another process; a lambda or local function cannot."""
    try:
        pickle.dumps(request)
    except (pickle.PicklingError, TypeError, AttributeError):
        return False
    return True


RETRIES = 3
"""Number of times that a failed block is tried again; Dask itself limits retries after workers that die."""
CONNECT = 20
"""Time to wait for the scheduler and for a first worker [s]."""
HOW = install_extra("cluster")


@lru_cache(maxsize=4)
def _opened(shipped: bytes) -> SweepRequest:
    request: SweepRequest = pickle.loads(shipped)
    return request


def task(shipped: bytes, block: int) -> SweepBlock:
    """Compute one block in a worker. Every task carries the pickled request, so that no task depends on a lost
    worker."""
    return evaluate(_opened(shipped), block)


def run_on_cluster(request: SweepRequest, blocks: Sequence[int], address: str) -> Iterator[tuple[int, SweepBlock]]:
    """Yield (index, block) as blocks are finished. The blocks of a lost worker are computed again elsewhere.

    Raises EngineMissing without Dask; MechlabError where no scheduler answers, or a worker has other versions.
    """
    try:
        from distributed import Client, as_completed
    except ModuleNotFoundError as missing:
        raise EngineMissing(f"--scheduler needs Dask ({missing.name} is missing): {HOW}.") from None
    try:
        shipped = pickle.dumps(request)
    except (pickle.PicklingError, TypeError, AttributeError) as cause:
        raise MechlabError(
            f"{request.name}: it cannot be sent to other machines ({cause}); put it into a file."
        ) from None
    try:
        client = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as cause:
        raise MechlabError(f"no Dask scheduler answers at {address}: {cause}") from None
    futures: list[Any] = []
    try:
        _same_versions(client, address)
        futures = client.map(
            task, [shipped] * len(blocks), list(blocks), retries=RETRIES, pure=False,
            key=[f"sweep-{request.fingerprint[:12]}-{block}-{id(futures):x}" for block in blocks],
        )  # fmt: skip
        number = {f.key: block for f, block in zip(futures, blocks, strict=True)}
        for batch in as_completed(futures, loop=client.loop, with_results=True, raise_errors=False).batches():
            for future, result in batch:
                if future.status != "finished":
                    raise _failure(future, number[future.key])
                yield number[future.key], result
                future.release()
    finally:
        client.cancel([f for f in futures if not f.done()])
        client.close()


def _same_versions(client: Any, address: str) -> None:
    """Raises MechlabError where a worker has other versions: its numbers would differ from those of this machine."""
    mine = versions()
    try:
        client.wait_for_workers(1, timeout=CONNECT)
    except TimeoutError:
        raise MechlabError(f"the scheduler at {address} has no worker; start one: dask worker {address}") from None
    try:
        theirs = client.run(versions)
    except ModuleNotFoundError as missing:
        raise MechlabError(f"the workers at {address} lack {missing.name}; install mechlab there.") from None
    for worker, found in theirs.items():
        if not isinstance(found, dict):
            raise MechlabError(f"the worker {worker} cannot tell its versions: {found}")
        other = [f"{k} {found.get(k)} instead of {v}" for k, v in mine.items() if found.get(k) != v]
        if other:
            raise MechlabError(
                f"the worker {worker} has {', '.join(other)}; its numbers would be others. Install the same."
            )


def _failure(future: Any, block: int) -> Exception:
    cause = future.exception() if future.status == "error" else None
    if isinstance(cause, MechlabError):
        return cause
    failure = f"{type(cause).__name__}: {cause}" if cause is not None else future.status
    return MechlabError(
        f"block {block} of the sweep could not be computed on the cluster: {' '.join(failure.split())[:300]}"
    )
