"""Settings that every test shares: pictures without a screen, one thread a process, repeatable examples."""

import os
import sys

if sys.platform == "linux":
    os.environ.setdefault("MUJOCO_GL", "egl")  # before anything imports mujoco
os.environ.setdefault("MPLBACKEND", "Agg")
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # the tests already run one process a core

from hypothesis import settings  # noqa: E402

settings.register_profile("mechlab", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("mechlab")
