"""The verbs as a table: what the signatures of the API do not say. Everything else is read from them (`mechlab.cli.options`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Switch:
    """An option that hands the verb to another function of the API; with a metavar its value is the `kind` for that function.

    implied: an option that only that function has is enough to choose it. flags: as in Verb. folders: a name that is a folder is
    enough, too.
    """

    function: str
    text: str
    metavar: str = ""
    implied: bool = False
    flags: Mapping[str, str] = field(default_factory=dict)
    folders: bool = False


@dataclass(frozen=True)
class Verb:
    """A verb: one line on it, its usage, the function of the API where its name differs, options with another name
    (keyword -> flag), options that must be given, pairs of options of which only one may be given, and switches by flag."""

    text: str
    usage: str
    function: str = ""
    flags: Mapping[str, str] = field(default_factory=dict)
    required: tuple[str, ...] = ()
    either: tuple[str, ...] = ()
    switches: Mapping[str, Switch] = field(default_factory=dict)


NOT_OPTIONS = {"settings", "laws", "drives", "progress", "command", "tasks", "times", "port", "wait", "pictures", "models", "names"}
"""Keywords of the API that are no options: for Python alone, or given in another way."""

VERBS: dict[str, Verb] = {
    "run": Verb("the whole pipeline: generate, check, simulate the default scene, make the page", "NAME [key=value ...]"),
    "list": Verb("the catalog", "", function="list_entries"),
    "show": Verb(
        "parameters, bodies, joints, chain, freedoms, redundancies, scenes, questions", "NAME [key=value ...]"
    ),
    "generate": Verb(
        "model files: MJCF, URDF, JSON, geometry",
        "[NAME] [key=value ...] -o DIR",
        required=("out",),
        switches={
            "--catalog": Switch("generate_catalog", "the whole catalog, a folder each, with sheet and picture"),
        },
    ),
    "solve": Verb(
        "give some quantities, get the others from each witness",
        "NAME|toolpath|bspline|regions|assur key=value ...",
        flags={"only": "--of"},
        switches={
            "--sensitivity": Switch(
                "sensitivity", "also the derivative of every answer by every parameter that is a number", implied=True
            ),
        },
    ),
    "simulate": Verb(
        "run a scene; final values, samples, health, cost", "NAME [key=value ...]", either=("timestep", "max_error")
    ),
    "sweep": Verb(
        "quantities over ranges of parameters, poses, initial states, loads; phase portraits; on all cores or a cluster",
        "NAME key=lo:hi:n ... [quantity=a,b]",
        flags={"quantities": "--quantity"},
        switches={
            "--portrait": Switch("portrait", "phase, poincare, exact, bifurcation, where a mechanism has them", "KIND"),
        },
    ),
    "cycle": Verb(
        "one turn of the drive: motion, drive force, reactions, shaking force, transmission, curves",
        "NAME [key=value ...]",
    ),
    "track": Verb(
        "lead frames, joints or shafts along a path through closed loops: poses, drive commands, limits, singularity",
        "NAME FRAME_x=lo:hi:n FRAME_z=... [key=value ...]",
    ),
    "check": Verb("every check with its witnesses", "[NAME ...] [key=value ...]"),
    "claims": Verb("the ledger of printed claims, with a verdict for each", "[NAME ...]"),
    "chart": Verb(
        "work-precision diagram: all methods, Pareto front, engine defaults, recommended setting",
        "NAME [key=value ...]",
        switches={
            "--fidelities": Switch(
                "fidelities", "the fidelities side by side: what each answers, its error, its cost"
            ),
        },
    ),
    "modes": Verb(
        "equilibrium, eigenfrequencies, damping and mode shapes on the constraint manifold",
        "NAME [key=value ...]",
        flags={"only": "--mode"},
    ),
    "stability": Verb(
        "where each method fails: timestep against stiffness, mass and gear ratio, singularity, friction",
        "NAME [key=value or key=lo:hi:n ...]",
        flags={"kinds": "--map"},
    ),
    "synthesize": Verb(
        "dimensions from wanted properties: motion, path, function, straight_line, dwell, planetary, gear_linkage, closed_differential",
        "TASK key=value ...",
    ),
    "compare": Verb(
        "mechanisms of one purpose side by side, as a table or a page: straight-line, quick-return, walking", "TASK [-o FILE.html]"
    ),
    "optimize": Verb(
        "the best parameters for a goal under constraints; the front of two goals",
        "NAME [key=lo:hi or key=value ...]",
    ),
    "fit": Verb(
        "parameters from measured series: values with 95 % intervals, and what the data do not determine",
        "NAME data.csv [key=lo:hi or key=value ...]",
    ),
    "workspace": Verb(
        "where a mechanism can be: nodes, volume, margins, dexterity, surface, two designs compared",
        "NAME [key=value or key=lo:hi:n ...]",
        flags={"maps": "-o"},
    ),
    "doctor": Verb(
        "diagnosis of an MJCF or URDF, a cured copy of it, or a table over folders of them",
        "FILE|FOLDER ...",
        switches={
            "--fix": Switch("cure", "write a cured copy, and show by a run what it gained"),
            "--audit": Switch("audit", "a table over folders; a FOLDER as name is enough", folders=True),
        },
    ),
    "view": Verb(
        "the lab page of a mechanism or a recording, live or as a file",
        "NAME|run.npz [key=value ...]",
        flags={"explorable": "--explore"},
        switches={
            "--new": Switch("draw", "an empty plane in which a planar linkage is drawn, and saved as a model"),
            "--studio": Switch("studio", "MuJoCo's own web viewer, whose port is open to the whole network"),
            "--catalog": Switch(
                "gallery", "with --html DIR: a gallery of all mechanisms, for any static host", flags={"out": "--html"}
            ),
        },
    ),
}  # fmt: skip
