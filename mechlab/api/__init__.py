"""The public API: finds a mechanism in the catalog, a user's file or an object, and hands it on.

Every verb of the command line is one function here; `Design` (what `load` gives) carries the parameters.
"""

from mechlab.api.designs import workspace
from mechlab.api.finding import Source, find, load
from mechlab.api.models import check, claims, generate, generate_catalog, list_entries, run, show, synthesize
from mechlab.api.runs import chart, cycle, portrait, simulate, simulate_values, solve, solve_values
from mechlab.api.studies import fidelities, modes, stability
from mechlab.api.viewing import explore, gallery, story, studio, view

__all__ = [
    "Source",
    "chart",
    "check",
    "claims",
    "cycle",
    "explore",
    "fidelities",
    "find",
    "gallery",
    "generate",
    "generate_catalog",
    "list_entries",
    "load",
    "modes",
    "portrait",
    "run",
    "show",
    "simulate",
    "simulate_values",
    "solve",
    "solve_values",
    "stability",
    "story",
    "studio",
    "synthesize",
    "view",
    "workspace",
]
