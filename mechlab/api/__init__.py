"""The public API: finds a mechanism in the catalog, a user's file or an object, and hands it on.

Every verb of the command line is one function here; `Design` (what `load` gives) carries the parameters.
"""

from mechlab.api.choosing import optimize, sensitivity
from mechlab.api.designs import workspace
from mechlab.api.finding import Source, find, load
from mechlab.api.models import check, claims, doctor, generate, generate_catalog, list_entries, run, show, synthesize
from mechlab.api.notebook import recording_page
from mechlab.api.runs import chart, cycle, portrait, simulate, simulate_values, solve, solve_values
from mechlab.api.studies import fidelities, modes, stability
from mechlab.api.sweeps import sweep
from mechlab.api.viewing import explore, gallery, story, studio, view
from mechlab.experiment.report import offer_page
from mechlab.formats import load_recording

offer_page(recording_page)

__all__ = [
    "Source",
    "chart",
    "check",
    "claims",
    "cycle",
    "doctor",
    "explore",
    "fidelities",
    "find",
    "gallery",
    "generate",
    "generate_catalog",
    "list_entries",
    "load",
    "load_recording",
    "modes",
    "optimize",
    "portrait",
    "run",
    "sensitivity",
    "show",
    "simulate",
    "simulate_values",
    "solve",
    "solve_values",
    "stability",
    "story",
    "studio",
    "sweep",
    "synthesize",
    "view",
    "workspace",
]
