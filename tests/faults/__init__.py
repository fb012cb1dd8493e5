"""Fault injection: seeded errors in builders, writers and closed forms that `mechlab check` must catch."""
