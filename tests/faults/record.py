"""Write `mechlab/study/record.json`: the numbers that check G7 compares with. `python -m tests.faults.record`."""

from __future__ import annotations

import datetime
import json
from importlib import metadata

from mechlab import catalog
from mechlab.study.record import FILE, of_entry


def main() -> None:
    """Every mechanism of the catalog, each fidelity, at its default parameters."""
    found = {name: of_entry(catalog.entry(name)) for name in sorted(catalog.NAMES)}
    head = {"date": datetime.date.today().isoformat(), "numpy": metadata.version("numpy")}
    FILE.write_text(json.dumps(head | {"mechanisms": found}, indent=0) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
