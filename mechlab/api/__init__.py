"""The public API: one function per verb. It finds a mechanism in the catalog, a user's file or an object, and hands it on.

Nothing heavy is imported before a verb is called: the command line reads its options, their types, defaults and help from the
signatures and docstrings of these functions. In a docstring the entries under "Options:" are `name=METAVAR: help`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mechlab.errors import warn
from mechlab.on_demand import on_demand
from mechlab.results import offer_page

if TYPE_CHECKING:
    from mechlab.api.arguments import Values
    from mechlab.api.designs import compare, fit, optimize, synthesize
    from mechlab.api.diagnoses import audit, cure, doctor
    from mechlab.api.finding import Source, find, load
    from mechlab.api.models import check, claims, edit, generate, generate_catalog, list_entries, run, show
    from mechlab.api.runs import chart, cycle, fidelities, portrait, sensitivity, simulate, solve
    from mechlab.api.sessions import environment, environments, linearize, session
    from mechlab.api.studies import modes, stability, sweep, workspace
    from mechlab.api.tracking import track
    from mechlab.api.viewing import draw, explore, gallery, load_recording, story, studio, view

_HOMES = {
    "arguments": ("Values",),
    "designs": ("compare", "fit", "optimize", "synthesize"),
    "diagnoses": ("audit", "cure", "doctor"),
    "finding": ("Source", "find", "load"),
    "models": ("check", "claims", "edit", "generate", "generate_catalog", "list_entries", "run", "show"),
    "runs": ("chart", "cycle", "fidelities", "portrait", "sensitivity", "simulate", "solve"),
    "sessions": ("environment", "environments", "linearize", "session"),
    "studies": ("modes", "stability", "sweep", "workspace"),
    "tracking": ("track",),
    "viewing": ("draw", "explore", "gallery", "load_recording", "story", "studio", "view"),
}
_find = on_demand(__name__, _HOMES)

__all__ = [
    "Source", "Values", "audit", "chart", "check", "claims", "compare", "cure", "cycle", "doctor", "draw", "edit", "environment",
    "environments", "explore", "fidelities", "find", "fit", "gallery", "generate",
    "generate_catalog", "linearize",
    "list_entries", "load", "load_recording", "modes", "optimize", "portrait", "run", "sensitivity", "session", "show",
    "simulate", "solve", "stability", "story", "studio", "sweep", "synthesize", "track", "view", "workspace",
]  # fmt: skip


def _page(recording: Any) -> str:
    from mechlab.api.viewing import page_of_recording

    return page_of_recording(recording)


offer_page(_page)

_OLD = {"solve_values": "solve", "simulate_values": "simulate"}


def __getattr__(name: str) -> Any:
    """Names of its modules, and old ones for one more release."""
    if name in _OLD:
        warn(f"mechlab.api.{name} is mechlab.{_OLD[name]} now", DeprecationWarning)
    return _find(_OLD.get(name, name))
