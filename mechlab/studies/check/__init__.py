"""`check` and `claims`: checks of an entry by all witnesses, and the ledger of printed statements."""
