"""An older processor than this one, as far as numpy, OpenBLAS and the C library can be told to take this for one.

`python -m tests.processor` prints the settings as NAME=VALUE, a line each, for `env`.
"""

import platform

import numpy as np

NAMES = ("NPY_DISABLE_CPU_FEATURES", "OPENBLAS_CORETYPE", "GLIBC_TUNABLES")


def older() -> dict[str, str]:
    """Environment variables: numpy without any feature that it found here beyond those it was built for, OpenBLAS for a
    processor of the oldest kind that it has code for, the C library's functions without fused multiply-add."""
    found = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    settings = {"NPY_DISABLE_CPU_FEATURES": " ".join(found)} if found else {}
    if platform.machine().lower() in ("x86_64", "amd64"):
        settings["OPENBLAS_CORETYPE"] = "Nehalem"
        settings["GLIBC_TUNABLES"] = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F"
    elif platform.machine().lower() in ("aarch64", "arm64"):
        settings["OPENBLAS_CORETYPE"] = "ARMV8"
    return settings


if __name__ == "__main__":
    print("\n".join(f"{name}={value}" for name, value in older().items()))
