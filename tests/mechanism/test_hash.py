"""The hash of a mechanism: kept by it, equal for equal ones, and found anew in another process."""

import os
import pickle
import subprocess
import sys

import mechlab as ml

LOOKED_UP = "import pickle, sys; m, other = pickle.load(sys.stdin.buffer); assert m == other and {m: 1}[other] == 1"


def test_equal_mechanisms_are_found_in_tables_in_any_process() -> None:
    first, second = ml.load("fourbar").mechanism(), ml.load("fourbar").mechanism()
    assert first == second and {first: 1}[second] == 1
    assert hash(first) != hash(ml.load("fourbar", crank="11cm").mechanism())
    # texts have other hashes there: a hash that travelled with one of the two would not be found
    hash(first)
    env = os.environ | {"PYTHONHASHSEED": "7"}
    subprocess.run([sys.executable, "-c", LOOKED_UP], input=pickle.dumps((first, second.__class__(**vars_of(second)))), env=env, check=True)


def vars_of(m: ml.Mechanism) -> dict:
    """Its data, without what was kept."""
    return {k: getattr(m, k) for k in type(m).__dataclass_fields__}
