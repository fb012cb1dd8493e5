"""The public API: finds a mechanism in the catalog, a user's file or an object, and hands it on.

Every verb of the command line is one function here; `Design` (what `load` gives) carries the parameters.
"""

from mechlab.api.finding import Source, find, load
from mechlab.api.models import check, claims, generate, generate_catalog, list_entries, run, show, synthesize
from mechlab.api.runs import chart, cycle, portrait, simulate, simulate_values, solve, solve_values
from mechlab.api.viewing import explore, gallery, story, studio, view

__all__ = [
    "Source",
    "chart",
    "check",
    "claims",
    "cycle",
    "explore",
    "find",
    "gallery",
    "generate",
    "generate_catalog",
    "list_entries",
    "load",
    "portrait",
    "run",
    "show",
    "simulate",
    "simulate_values",
    "solve",
    "solve_values",
    "story",
    "studio",
    "synthesize",
    "view",
]
