"""The table of the catalog against the entries themselves."""

from mechlab.catalog import NAMES, entry
from mechlab.catalog.table import TABLE


def test_every_row_is_that_of_its_entry() -> None:
    assert len(set(NAMES)) == len(TABLE)
    for row in TABLE:
        e = entry(row.name)
        assert row.name == e.name
        assert row.title == e.title
        assert row.summary == e.summary
        assert row.fidelities == tuple(e.fidelities)
        assert row.scenes == tuple(e.scenes)
