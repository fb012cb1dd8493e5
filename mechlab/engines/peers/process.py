"""Timed runs of a peer in a process of its own, kept between runs and started again after a crash or a limit: a crash is a reason
why a run ended, not the end of the program.

The clock of a run, `Trace.total_s`, is the CPU time of that process, all its threads included, for building the engine's model,
stepping and output. Not in it: imports and compiled kernels (`prepare` of an adapter), the start of the scene and the tree of
links, which are handed over, and the way between the processes.

Run as `python -m mechlab.engines.peers.process PEER`, this module is the other process. A message is 8 bytes of length and that
many bytes of pickle: of (Job, limit) one way, of (Trace, "") or (None, sentence) the other.
"""

from __future__ import annotations

import atexit
import os
import pickle
import select
import signal
import subprocess
import sys
import time
import warnings
from dataclasses import replace
from importlib import import_module
from typing import Any, BinaryIO

from mechlab.engines.peers.job import Job
from mechlab.errors import MechlabError

LENGTH = 8


def write_message(stream: BinaryIO, content: Any) -> None:
    """Send one message."""
    data = pickle.dumps(content)
    stream.write(len(data).to_bytes(LENGTH, "little") + data)
    stream.flush()


def read_message(stream: BinaryIO) -> Any:
    """Receive one message; None at the end of the stream."""
    head = stream.read(LENGTH)
    if len(head) < LENGTH:
        return None
    data = stream.read(int.from_bytes(head, "little"))
    return pickle.loads(data)


WALL = 6.0
"""A run may take this many times its CPU limit in wall time (other processes share the cores), and START more."""
START = 300.0
"""Imports, and kernels that are compiled before the first run [s]."""


class PeerStopped(MechlabError):
    """The peer used up its time."""


class PeerFailed(MechlabError):
    """The peer raised an error, or its process died."""


class Process:
    """One peer's process."""

    def __init__(self, peer: str) -> None:
        self.peer = peer
        self._popen: subprocess.Popen[bytes] | None = None

    def ask(self, job: Job, limit: float) -> Any:
        """The Trace of a job within `limit` seconds of CPU time, setting up included.

        Raises PeerStopped past the limit, PeerFailed when the engine raises or its process dies.
        """
        running = self._started()
        assert running.stdin is not None and running.stdout is not None
        try:
            write_message(running.stdin, (job, limit))  # type: ignore[arg-type]
            answer = _read(running.stdout.fileno(), time.monotonic() + START + WALL * limit)
        except (BrokenPipeError, EOFError):
            raise self._died(limit) from None
        except TimeoutError:
            self.end()
            raise PeerStopped(f"{self.peer} was stopped: no answer within {START + WALL * limit:.3g} s") from None
        trace, why = answer
        if trace is None:
            raise PeerFailed(f"{self.peer}: {why}")
        return trace

    def _started(self) -> subprocess.Popen[bytes]:
        if self._popen is None or self._popen.poll() is not None:
            self.end()
            one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
            self._popen = subprocess.Popen(
                [sys.executable, "-m", "mechlab.engines.peers.process", self.peer],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=os.environ | one,
            )  # fmt: skip
        return self._popen

    def _died(self, limit: float) -> MechlabError:
        assert self._popen is not None
        code = self._popen.wait()
        self.end()
        if code == -getattr(signal, "SIGPROF", 0) and code:
            return PeerStopped(f"{self.peer} was stopped after {limit:.3g} s of CPU")
        end = f"signal {-code}" if code < 0 else f"exit code {code}"
        return PeerFailed(f"the process of {self.peer} died ({end})")

    def end(self) -> None:
        """End the process, if there is one."""
        if self._popen is None:
            return
        for stream in (self._popen.stdin, self._popen.stdout):
            if stream is not None:
                try:
                    stream.close()
                except BrokenPipeError:
                    pass
        if self._popen.poll() is None:
            self._popen.kill()
        self._popen.wait()
        self._popen = None


def _read(source: int, deadline: float) -> Any:
    size = int.from_bytes(_bytes(source, LENGTH, deadline), "little")
    return pickle.loads(_bytes(source, size, deadline))


def _bytes(source: int, count: int, deadline: float) -> bytes:
    parts: list[bytes] = []
    while count:
        if hasattr(select, "poll") and not select.select([source], [], [], max(0.0, deadline - time.monotonic()))[0]:
            raise TimeoutError
        part = os.read(source, min(count, 1 << 20))
        if not part:
            raise EOFError
        parts.append(part)
        count -= len(part)
    return b"".join(parts)


_PROCESSES: dict[str, Process] = {}


def process(peer: str) -> Process:
    """The process of a peer; all are ended when Python ends."""
    if peer not in _PROCESSES:
        _PROCESSES[peer] = Process(peer)
        atexit.register(_PROCESSES[peer].end)
    return _PROCESSES[peer]


def limit_cpu(seconds: float) -> None:
    """End this process after `seconds` of CPU time; 0: never. Systems without such a timer have no limit."""
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, seconds)


def serve(peer: str) -> None:
    """The process that a peer runs in: answer jobs from standard input on standard output, until the input ends.

    Engines print and crash as they like: their output goes nowhere, and a run that uses up its CPU time is ended by the system, in
    the middle of the engine's own code if need be.
    """
    answers = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    warnings.simplefilter("ignore")
    engine = import_module(f"mechlab.engines.peers.{peer}")
    while (message := read_message(sys.stdin.buffer)) is not None:
        job, limit = message
        try:
            engine.prepare(job)
            limit_cpu(limit)
            began = time.process_time()
            trace = engine.run(job)
            answer: Any = (replace(trace, total_s=time.process_time() - began), "")
        except Exception as error:  # whatever a foreign engine raises is an answer
            lines = str(error).strip().splitlines() or [type(error).__name__]
            answer = (None, lines[0][:200])
        limit_cpu(0.0)
        write_message(answers, answer)


if __name__ == "__main__":
    serve(sys.argv[1])
