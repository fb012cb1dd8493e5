"""Stability maps: timestep against what may make a method fail, by measurement, with the boundaries of theory.

`study` makes the maps that the structure of a mechanism calls for; `KINDS` is the registry of them.
"""
