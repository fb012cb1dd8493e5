"""Work in several processes at once, which end with this one, and at once when it is interrupted."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import connection, get_context, parent_process
from threading import Thread
from typing import TypeVar

Task = TypeVar("Task")
Found = TypeVar("Found")

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "LP_NUM_THREADS": "0"}
"""Settings of a worker that the user did not make: numpy's algebra and Mesa's software renderer start no threads of their own,
since every core already has a worker."""
AHEAD = 4
"""Number of tasks submitted to the pool for each worker."""


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_processes(work: Callable[[Task], Found], tasks: Sequence[Task], workers: int) -> Iterator[tuple[Task, Found]]:
    """Yield (task, work(task)) as they are finished; `work`, tasks and results travel to other processes and back.

    Raises what `work` raises, and BrokenProcessPool where a worker was killed.
    """
    waiting = list(tasks)
    pool = ProcessPoolExecutor(min(workers, len(tasks)), mp_context=get_context("spawn"), initializer=_begin)
    try:
        running: dict[Future[Found], Task] = {}
        while waiting or running:
            while waiting and len(running) < AHEAD * workers:
                task = waiting.pop(0)
                with _undisturbed():
                    running[pool.submit(work, task)] = task
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(future), future.result()
    except BaseException:
        for process in list(getattr(pool, "_processes", None) or {}):
            _end(process)
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _begin() -> None:
    """Start of a worker: it works in one thread, ignores Ctrl-C, which the parent handles, and ends when the parent process ends."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
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


def _end(process: int) -> None:
    """Terminate a worker by its process number, so that work that ends early need not wait for it."""
    try:
        os.kill(process, signal.SIGTERM)
    except (ProcessLookupError, PermissionError):
        return
