"""The same questions and runs give the same numbers on another processor.

The other processor is this one with its newer instructions hidden from numpy, OpenBLAS and the C library: sines, sums and
factorizations then differ in their last bits (`test_the_other_processor_is_another_one` sees that they do).
"""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from tests.processor import NAMES

ROOT = Path(__file__).parents[1]
ROUNDING = 1e-12
"""Of the largest number of a state or an answer: some hundred steps of rounding errors of 1e-16 of numbers of its size."""

BITS = """
import hashlib, math, numpy as np
x = np.linspace(0.01, 3.0, 20001)
a = np.random.default_rng(0).standard_normal((60, 60))
parts = np.sin(x), np.array([math.sin(v) for v in x]), np.linalg.svd(a)[1], a @ a
print(hashlib.sha256(b"".join(p.tobytes() for p in parts)).hexdigest())
"""


def output(settings: Mapping[str, str], *words: str) -> str:
    """What Python prints with these settings, and none of them inherited."""
    plain = {k: v for k, v in os.environ.items() if k not in NAMES}
    where = {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-W", "error::ImportWarning", *words]
    return subprocess.run(
        command, cwd=ROOT, env=plain | where | settings, capture_output=True, text=True, check=True, timeout=900
    ).stdout


@pytest.fixture(scope="module")
def older() -> dict[str, str]:
    lines = output({}, "-m", "tests.processor").splitlines()
    settings = dict(line.split("=", 1) for line in lines)
    if not settings:
        pytest.skip("there is no other processor that this one could be taken for")
    return settings


def test_the_other_processor_is_another_one(older: dict[str, str]) -> None:
    if "GLIBC_TUNABLES" not in older:
        pytest.skip("only known of x86")
    assert output({}, "-c", BITS) == output({}, "-c", BITS) != output(older, "-c", BITS)


@pytest.mark.slow
def test_questions_and_runs_have_the_same_numbers_on_both(older: dict[str, str]) -> None:
    here, there = (json.loads(output(s, "-m", "tests.machine_numbers")) for s in ({}, older))
    assert list(here) == list(there) and len(here) > 50
    off = {}
    for name, one in here.items():
        a, b = np.array(one), np.array(there[name])
        difference = np.max(np.abs(a - b)) / np.max(np.abs(a))
        if not (a.shape == b.shape and difference <= ROUNDING):
            off[name] = float(difference)
    assert not off
