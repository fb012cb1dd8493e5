"""The process that a peer runs in: reads jobs from standard input, answers on standard output.

Run as `python -m mechlab.engines.peers.child PEER`. A message is 8 bytes of length and that many bytes of pickle: of (Job, limit)
one way, of (Trace, "") or (None, sentence) the other. Engines print and crash as they like: their output goes nowhere, and
a run that uses up its CPU time is ended by the system, in the middle of the engine's own code if need be.
"""

from __future__ import annotations

import os
import signal
import sys
from importlib import import_module
from typing import Any

from mechlab.engines.peers.process import read_message, write_message


def limit_cpu(seconds: float) -> None:
    """End this process after `seconds` of CPU time; 0: never. Systems without such a timer have no limit."""
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, seconds)


def main() -> None:
    """Serve until the input ends."""
    answers = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    engine = import_module(f"mechlab.engines.peers.{sys.argv[1]}")
    while (message := read_message(sys.stdin.buffer)) is not None:
        job, limit = message
        limit_cpu(limit)
        try:
            answer: Any = (engine.run(job), "")
        except Exception as error:  # whatever a foreign engine raises is an answer
            lines = str(error).strip().splitlines() or [type(error).__name__]
            answer = (None, lines[0][:200])
        limit_cpu(0.0)
        write_message(answers, answer)


if __name__ == "__main__":
    main()
