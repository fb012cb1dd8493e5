"""Closed forms of the mechanisms: plain arrays in and out, no engine."""
