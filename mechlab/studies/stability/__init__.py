"""Stability maps: outcome of runs over the timestep and a quantity that may make a method fail, with limits from
theory.

`study` makes the maps that the structure of a mechanism calls for; `KINDS` is the registry of them.
"""
