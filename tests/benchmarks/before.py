"""Numbers of an older build, for the last column of the table of benchmarks: (section, name of the row) -> value in its unit.

CPU seconds on two shared cores under load, in runs of their own: right within a factor of 1.5.
"""

DATE = "2026-11-22"

BEFORE: dict[tuple[str, str], float] = {}
