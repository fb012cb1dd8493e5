"""Words and numbers as people read them."""

from mechlab.tables import counted, number


def test_counts_and_zeros() -> None:
    assert counted(1, "body", "bodies") == "1 body" and counted(2, "body", "bodies") == "2 bodies"
    assert counted(1, "row") == "1 row" and counted(0, "row") == "0 rows"
    assert number(-0.0) == "0" and number([-0.0, -1.5]) == "[0, -1.5]"
