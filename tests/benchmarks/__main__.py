"""All benchmarks as one table of ratios, in markdown; a report, which asserts nothing.

    python -m tests.benchmarks [-o assets/benchmarks.md] [--only SECTION ...] [--limit SECONDS]

A section is a module `bench_NAME.py` with a function `rows() -> list[Row]` (`tests.benchmarks.rows`). Each runs in a process of its
own, one after the other; one that fails is listed with its error. Beside each value stand its reference, measured in the same
process, and the number of an older build on another day (`tests.benchmarks.before`): compare ratios, not seconds.
"""

from __future__ import annotations

import argparse
import importlib
import json
import math
import os
import platform
import subprocess
import sys
from dataclasses import asdict
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from tests.benchmarks.before import BEFORE, DATE
from tests.benchmarks.rows import Row

SECTIONS = ("recording", "laws", "max_error", "peers", "closer", "linkages", "sweep", "large", "verbs")
"""The order of the table; every other module with rows follows."""
PACKAGES = (
    "mechanism-lab", "mujoco", "pin", "numpy", "scipy", "exudyn", "drake", "opensim", "mujoco-warp", "newton", "warp-lang", "placo",
    "pylinkage",
)  # fmt: skip
LIMIT = 1800.0
"""Wall time that a section may take, unless told otherwise [s]."""
FOLDER = Path(__file__).parent
HEADS = ("what", "value", "unit", "beside it", "its value", "ratio", "asked", "met", f"build of {DATE}")


def known_sections() -> list[str]:
    """Names of all sections, in the order of the table."""
    found = {p.stem.removeprefix("bench_") for p in FOLDER.glob("bench_*.py") if "def rows(" in p.read_text("utf-8")}
    return [*SECTIONS, *sorted(found - set(SECTIONS))]


def rows_of(section: str, limit: float) -> list[Row] | str:
    """The rows of a section, run in a process of its own; a sentence where it failed."""
    command = [sys.executable, "-m", "tests.benchmarks", "--json", section]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return f"stopped after {limit:g} s of wall time"
    last = (done.stdout.strip().splitlines() or [""])[-1]
    if done.returncode or not last.startswith("["):
        said = done.stderr.strip().splitlines() or [f"exit code {done.returncode}, no rows"]
        return said[-1][:300]
    return [Row(**row) for row in json.loads(last)]


def load() -> str:
    """Load averages over 1, 5 and 15 minutes."""
    return " ".join(f"{x:.2f}" for x in os.getloadavg()) if hasattr(os, "getloadavg") else "unknown"


def processor() -> str:
    """Model of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((x.partition(":")[2].strip() for x in lines if x.startswith("model name")), platform.machine())


def versions() -> str:
    """Installed versions of what is measured."""
    out = [f"python {platform.python_version()}"]
    for name in PACKAGES:
        try:
            out.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            continue
    return ", ".join(out)


def shown(x: float) -> str:
    """Three digits; empty for a missing number."""
    if not math.isfinite(x):
        return "" if math.isnan(x) else str(x)
    return f"{x:,.0f}" if abs(x) >= 1000 else f"{x:.3g}"


def line(section: str, row: Row) -> str:
    """A row of the table."""
    before = BEFORE.get((section, row.name), math.nan)
    met = {True: "yes", False: "**no**", None: ""}[row.met]
    asked = row.asked.replace("<=", "≤").replace(">=", "≥")
    cells = [
        row.name, shown(row.value), row.unit, row.beside, shown(row.reference), shown(row.ratio), asked, met,
        before if isinstance(before, str) else f"{shown(before)} {row.unit}" if math.isfinite(before) else "",
    ]  # fmt: skip
    return f"| {' | '.join(c.replace('|', '/') for c in cells)} |"


def report(sections: list[str], limit: float) -> str:
    """The whole document; progress goes to the standard error."""
    began, load_before = datetime.now(UTC), load()
    parts, goals = [], list[bool]()
    for section in sections:
        print(f"{section} ...", file=sys.stderr, flush=True)
        found = rows_of(section, limit)
        parts += ["", f"## {section}", ""]
        if isinstance(found, str):
            parts.append(f"**failed**: {found}")
            continue
        parts += [f"| {' | '.join(HEADS)} |", "|---|" + "---:|---|---|" + "---:|" * 2 + "---|---|---:|"]
        parts += [line(section, row) for row in found]
        goals += [row.met for row in found if row.met is not None]
    ended = datetime.now(UTC)
    head = [
        "# Benchmarks",
        "",
        f"{began:%Y-%m-%d %H:%M} to {ended:%H:%M} UTC, by `python -m tests.benchmarks`. CPU time, not wall time.",
        f"{processor()}, {os.cpu_count()} cores; load average {load_before} at the start, {load()} at the end.",
        f"{versions()}.",
        "",
        f"Ratio = value / its neighbour, both measured in one process. {sum(goals)} of {len(goals)} goals are met. The last column is of "
        f"the build of {DATE}, taken under another load.",
    ]
    return "\n".join([*head, *parts]) + "\n"


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description="All benchmarks as one table.")
    parser.add_argument("-o", metavar="FILE", type=Path, help="write the table to this file")
    parser.add_argument("--only", metavar="SECTION", nargs="+", choices=known_sections(), help="only these sections")
    parser.add_argument("--limit", type=float, default=LIMIT, help=f"wall time for a section [s] ({LIMIT:g})")
    parser.add_argument("--json", metavar="SECTION", help="the rows of one section, as one line of JSON")
    asked = parser.parse_args()
    if asked.json:
        found = importlib.import_module(f"tests.benchmarks.bench_{asked.json}").rows()
        print(json.dumps([asdict(row) for row in found]))
        return
    text = report(asked.only or known_sections(), asked.limit)
    if asked.o:
        asked.o.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
