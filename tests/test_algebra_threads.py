"""numpy's and scipy's algebra in one thread while mechlab works, and as before afterwards: read from the libraries in a process of its own,
as the tests themselves run with one thread."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import numpy, scipy.linalg
from threadpoolctl import threadpool_info
import mechlab as ml
from mechlab.algebra_threads import one_algebra_thread

def threads():
    return sorted(x["num_threads"] for x in threadpool_info() if x["user_api"] == "blas")

seen = []
print(threads())
with one_algebra_thread():
    print(threads())
    with one_algebra_thread():
        pass
    print(threads())
print(threads())
try:
    with one_algebra_thread():
        raise KeyboardInterrupt
except KeyboardInterrupt:
    print(threads())
ml.check("pendulum", progress=lambda *_: seen.append(threads()))
print(seen[-1], threads())
"""


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core: the algebra has one thread anyway")
def test_algebra_takes_one_thread_while_it_works_and_as_many_as_before_afterwards() -> None:
    free = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    for environment, (many, one) in ((free, ("[2, 2]", "[1, 1]")), (free | {"OMP_NUM_THREADS": "2"}, ("[2, 2]", "[2, 2]"))):
        run = subprocess.run([sys.executable, "-c", f"import os; os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])\n{SCRIPT}"],
                             capture_output=True, text=True, env=environment, check=True)  # fmt: skip
        assert run.stdout.splitlines() == [many, one, one, many, many, f"{one} {many}"]
