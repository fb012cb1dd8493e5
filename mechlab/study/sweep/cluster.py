"""Blocks on an existing Dask cluster: the same function, the same blocks, hence the same bits."""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

from mechlab.errors import EngineMissing, MechlabError
from mechlab.study.run import versions
from mechlab.study.sweep.block import Block
from mechlab.study.sweep.evaluate import evaluate
from mechlab.study.sweep.request import Request

RETRIES = 3
"""A block that fails in a worker is given to another so many times; one whose worker dies, by Dask as often as it allows."""
CONNECT = 20
"""Seconds to wait for the scheduler."""
HOW = "pip install 'mechlab[cluster]'"


@lru_cache(maxsize=4)
def _opened(shipped: bytes) -> Request:
    request: Request = pickle.loads(shipped)
    return request


def task(shipped: bytes, block: int) -> Block:
    """One block, in a worker. The request comes as bytes with every task: what a lost worker held is needed by none."""
    return evaluate(_opened(shipped), block)


def run(request: Request, blocks: Sequence[int], address: str) -> Iterator[tuple[int, Block]]:
    """(block, what it gave), as they are finished. A worker that is lost costs the blocks that it was busy with, which are
    computed again elsewhere. Raises MechlabError where there is no scheduler, or versions in the workers are others."""
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
    """Numbers are promised to be those of this machine: that takes the same versions."""
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
    said = f"{type(cause).__name__}: {cause}" if cause is not None else future.status
    return MechlabError(
        f"block {block} of the sweep could not be computed on the cluster: {' '.join(said.split())[:300]}"
    )
