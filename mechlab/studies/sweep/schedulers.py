"""Schedulers of blocks: this process while little work is left, else a pool of processes; or a Dask cluster."""

from __future__ import annotations

import os
import pickle
import signal
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import lru_cache
from multiprocessing import connection, get_context, parent_process
from threading import Thread
from typing import Any

from mechlab.errors import EngineMissing, MechlabError, install_extra
from mechlab.lab.single_run import versions
from mechlab.studies.sweep.evaluate import evaluate
from mechlab.studies.sweep.request import ANSWERS, RUNS, SweepBlock, SweepRequest

WORTH_IT = 4.0
"""Remaining work [s] above which a pool of processes pays: it takes a second or two to start."""
AHEAD = 4
"""Number of blocks submitted to the pool for each worker."""


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
        for block, found in _pool(request, left, many):
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


def _begin() -> None:
    """Start of a worker: it ignores Ctrl-C, which the parent handles, and ends when the parent process ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if (parent := parent_process()) is not None:
        Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Blocks Ctrl-C while a worker starts: a worker interrupted in its start would print a traceback."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _pool(request: SweepRequest, blocks: Sequence[int], workers: int) -> Iterator[tuple[int, SweepBlock]]:
    waiting = list(blocks)
    pool = ProcessPoolExecutor(min(workers, len(blocks)), mp_context=get_context("spawn"), initializer=_begin)
    try:
        running: dict[Future[SweepBlock], int] = {}
        while waiting or running:
            while waiting and len(running) < AHEAD * workers:
                block = waiting.pop(0)
                with _undisturbed():
                    running[pool.submit(evaluate, request, block)] = block
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(future), future.result()
    except BaseException:
        for process in list(getattr(pool, "_processes", None) or {}):
            _end(process)
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _end(process: int) -> None:
    """Terminate a worker by its process number, so that a sweep that ends early need not wait for it."""
    try:
        os.kill(process, signal.SIGTERM)
    except (ProcessLookupError, PermissionError):
        return


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
