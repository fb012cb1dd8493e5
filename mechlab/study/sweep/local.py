"""Blocks on this machine: in this process while that is quick, else in a pool of processes."""

from __future__ import annotations

import os
import pickle
import signal
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import connection, get_context, parent_process
from threading import Thread

from mechlab.errors import MechlabError
from mechlab.study.sweep.block import Block
from mechlab.study.sweep.evaluate import evaluate
from mechlab.study.sweep.request import ANSWERS, RUNS, Request

WORTH_IT = 4.0
"""Seconds of work that must be left for a pool of processes, which takes a second or two to come up."""
AHEAD = 4
"""Blocks that each worker has waiting."""


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run(request: Request, blocks: Sequence[int], workers: int | None = None) -> Iterator[tuple[int, Block]]:
    """(block, what it gave), as they are finished. workers: processes, by default one for each core; 1: no pool.

    The engine's own threads are used for rollouts, processes for what is asked or run point by point. A pool that breaks
    (a worker was killed) costs nothing but time: its blocks are computed here.
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


def _travels(request: Request) -> bool:
    """Whether the request can go to another process: a function without a name there cannot."""
    try:
        pickle.dumps(request)
    except (pickle.PicklingError, TypeError, AttributeError):
        return False
    return True


def _begin() -> None:
    """A worker leaves Ctrl-C to its parent, which cancels the rest, and ends when the parent is gone, however that ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if (parent := parent_process()) is not None:
        Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Ctrl-C waits until a worker has started: a half-started one would complain."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _pool(request: Request, blocks: Sequence[int], workers: int) -> Iterator[tuple[int, Block]]:
    waiting = list(blocks)
    pool = ProcessPoolExecutor(min(workers, len(blocks)), mp_context=get_context("spawn"), initializer=_begin)
    try:
        running: dict[Future[Block], int] = {}
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
    """What a worker is busy with is not waited for when the sweep ends early."""
    try:
        os.kill(process, signal.SIGTERM)
    except (ProcessLookupError, PermissionError):
        return
