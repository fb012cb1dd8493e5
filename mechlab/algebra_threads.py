"""The algebra of numpy and scipy in one thread, while the small matrices of mechanisms are worked on: its other threads would only burn
CPU waiting for work, up to three times what the work takes."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from threading import current_thread, main_thread
from typing import Any

NAMES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""What tells the algebra of numpy and scipy how many threads to take, besides OMP_NUM_THREADS."""


@contextmanager
def one_algebra_thread() -> Iterator[None]:
    """Within the block the algebra takes one thread; afterwards as many as before. A number that the user has set in the environment
    stays, and so it does in other threads than the main one, where OpenBLAS takes no orders."""
    asked = any(name in os.environ for name in ("OMP_NUM_THREADS", *NAMES))
    if asked or "numpy" not in sys.modules or current_thread() is not main_thread():
        yield
        return
    libraries = _libraries("scipy.linalg" in sys.modules)
    before = [x.num_threads for x in libraries]
    for library in libraries:
        library.set_num_threads(1)
    try:
        yield
    finally:
        for library, threads in zip(libraries, before, strict=True):
            library.set_num_threads(threads)


@lru_cache(maxsize=2)
def _libraries(both: bool) -> list[Any]:
    """The libraries of algebra that are loaded: numpy's, and scipy's where it is."""
    from threadpoolctl import ThreadpoolController  # not before numpy is there

    return [x for x in ThreadpoolController().lib_controllers if x.user_api == "blas"]
