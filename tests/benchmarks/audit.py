"""The public audit table: `python -m tests.benchmarks.audit FOLDER... -o assets`.

The folders are the sources of the models, as their packages and repositories unpack (dm_control, gymnasium, robosuite, ...);
`audit_models.txt` says which of their models the table shows, `audit_licences.json` the licences of those that carry no licence file.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import mechlab as ml

HERE = Path(__file__).parent


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("-o", dest="out", type=Path, default=Path("assets"))
    parser.add_argument("--jobs", type=int)
    given = parser.parse_args()
    found = ml.audit(
        given.folders, out=given.out, pick=HERE / "audit_models.txt", licences=HERE / "audit_licences.json", jobs=given.jobs
    )
    print(found)


if __name__ == "__main__":
    main()
