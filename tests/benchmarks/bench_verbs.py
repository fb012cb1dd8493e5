"""CPU seconds of verbs as a user starts them: user and system time of the whole process, beside the seconds asked for.

    python -m tests.benchmarks.bench_verbs [VERB ...]

Byte code is compiled first, as an installed package has it. Short verbs are started three times, the least counts; a bare
`import numpy` stands beside them. Numbers of a loaded machine are higher by up to a half. VERB: only commands that begin so.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import mechlab
from tests.benchmarks.rows import Row

SHORT = 1.0
"""A verb that takes less than this [s] is started three times."""


ASKED_FOR = (
    "andrews bricard class4_linkage closed_differential delta6 fivebar flyball fourbar gear_linkage impulse_transmission n_fourbar "
    "pendulum planetary planetary_stage platform_3rrr prosthetic_leg quick_return slider_crank stephenson wolfrom"
)
"""The entries that there were when `check` of all was asked to take 60 s."""
ASKED: Mapping[str, float] = {
    "import mechlab": 0.05,
    "--help": 0.1,
    "list": 0.2,
    "show fourbar": 0.2,
    "show delta6": 0.2,
    "solve fourbar crank_angle=1.2": 0.5,
    "generate fourbar -o {out}": 0.0,
    "run delta6 -o {out}": 6.0,
    f"check {ASKED_FOR}": 60.0,
    "check": 60.0,
    "claims": 15.0,
    "chart pendulum -o {out}.svg": 15.0,
    "chart n_fourbar -o {out}.svg": 15.0,
    "chart andrews -o {out}.svg": 15.0,
    "chart bricard -o {out}.svg": 15.0,
    "chart flyball -o {out}.svg": 15.0,
    "chart slider_crank -o {out}.svg": 15.0,
}
"""Command -> CPU seconds that it may take."""
BARE = "import numpy"


def seconds_of(arguments: Sequence[str], environment: Mapping[str, str]) -> float:
    """User and system seconds of a Python process; a check that fails (exit 3) is an answer too."""
    process = subprocess.Popen(
        [sys.executable, *arguments], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 3):
        raise RuntimeError(f"{' '.join(arguments)}: exit code {process.returncode}")
    return used.ru_utime + used.ru_stime


def rows(wanted: Sequence[str] = ()) -> Iterator[Row]:
    """The section `verbs` of the table of benchmarks, one row after the other; `wanted`: only commands that begin with one of these."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHONDONTWRITE", "PYTHONPYCACHE"))}
        package = Path(mechlab.__file__).parent
        subprocess.run([sys.executable, "-m", "compileall", "-q", str(package)], env=environment, check=True)
        bare = min(seconds_of(["-c", BARE], environment) for _ in range(3))
        for number, (verb, asked) in enumerate(ASKED.items()):
            if wanted and not verb.startswith(tuple(wanted)):
                continue
            words = [w.format(out=f"{folder}/{number}") for w in verb.split()]
            arguments = ["-c", verb] if words[0] == "import" else ["-m", "mechlab", *words]
            seconds = seconds_of(arguments, environment)
            again = [seconds_of(arguments, environment) for _ in range(2)] if seconds < SHORT else []
            limit = f"value <= {asked:g}" if asked else ""
            named = verb.replace(ASKED_FOR, "of the 20 entries of 2026-11-22")
            yield Row(named.format(out="OUT"), min([seconds, *again]), "s", BARE, bare, limit)


def main() -> None:
    """Print the table."""
    for row in rows(sys.argv[1:]):
        print(f"{row.name:34}{row.value:8.2f} s   {row.asked:14}{row.ratio:8.1f} x {row.beside}", flush=True)


if __name__ == "__main__":
    main()
