"""Numbers of an older build, for the last column of the table of benchmarks: (section, name of the row) -> value in its unit.

CPU seconds on two shared cores under load, in runs of their own: right within a factor of 1.5.
"""

DATE = "2026-11-22"

BEFORE: dict[tuple[str, str], float] = {
    # whole runs; ranges stood at their middle
    ("peers", "pendulum to 1e-03 m"): 0.071,
    ("peers", "n_fourbar to 1e-03 m"): 0.37,
    ("peers", "n_fourbar to 1e-06 m"): 0.40,
    ("peers", "andrews to 1e-03 m"): 0.45,
    ("peers", "andrews to 1e-06 m"): 0.43,
    ("peers", "bricard to 1e-03 m"): 0.35,
    ("peers", "bricard to 1e-06 m"): 0.28,
    ("peers", "slider_crank to 1e-03 m"): 0.23,
    ("peers", "slider_crank to 1e-06 m"): 0.21,
}
