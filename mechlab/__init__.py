"""mechlab: a mechanism lab. Describe a mechanism once; get model files, answers, motion and a page, each with witnesses.

>>> import mechlab as ml
>>> ml.solve("fourbar", crank_angle=1.0).max_difference < 1e-9
True
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mechlab.api import (
        audit,
        chart,
        check,
        claims,
        compare,
        cure,
        cycle,
        doctor,
        draw,
        edit,
        environment,
        environments,
        explore,
        fidelities,
        find,
        fit,
        gallery,
        generate,
        generate_catalog,
        linearize,
        list_entries,
        load,
        load_recording,
        modes,
        optimize,
        portrait,
        run,
        sensitivity,
        session,
        show,
        simulate,
        solve,
        stability,
        story,
        studio,
        sweep,
        synthesize,
        track,
        view,
        workspace,
    )
    from mechlab.errors import (
        EngineMissing,
        LeftOutWarning,
        MechlabError,
        NoSolution,
        Untrustworthy,
        UsageError,
    )
    from mechlab.experiment.entry import (
        Check,
        CheckResult,
        Claim,
        ClaimResult,
        Entry,
        SceneRecipe,
        Verdict,
    )
    from mechlab.experiment.laws import (
        AppliedForce,
        ComputedTorque,
        Constant,
        ConstantPower,
        DcMotor,
        FunctionLaw,
        Harmonic,
        Law,
        Motor,
        OneSidedStop,
        Plant,
        Servo,
        TableLaw,
        Viscous,
    )
    from mechlab.experiment.model_file import LeftOut, ModelFile
    from mechlab.experiment.motion import Hold, Ramp, Sine, Spline
    from mechlab.experiment.parameters import parameter
    from mechlab.experiment.question import (
        Answer,
        Answers,
        Question,
    )
    from mechlab.experiment.recording import (
        Health,
        Recording,
    )
    from mechlab.experiment.scene import (
        PRESETS,
        Scene,
        Settings,
    )
    from mechlab.formats import (
        from_json,
        from_mjcf,
        from_urdf,
        save_recording,
        to_json,
        to_mjcf,
        to_urdf,
    )
    from mechlab.formats.exports import (
        to_extended_urdf,
        to_sdf,
        to_usd,
    )
    from mechlab.lab.design import Design
    from mechlab.lab.own_mechanism import scene
    from mechlab.mechanism import (
        GROUND,
        Body,
        Builder,
        Drive,
        Frame,
        GearMesh,
        Inertia,
        Joint,
        LinearRelation,
        Loop,
        Mechanism,
        Placement,
        Shaft,
        Shape,
        Spring,
        Status,
        belt,
        floating,
        mimic,
        prismatic,
        relation,
        revolute,
        screw,
        spherical,
        universal,
    )
    from mechlab.mechanism.parts import LOOP_ROWS, Control, Winding
    from mechlab.shapes import shape
    from mechlab.studies.track.result import Track
    from mechlab.studies.track.tasks import (
        CenterOfMassTask,
        FrameTask,
        PostureTask,
        RangeLimit,
        RateLimit,
        SingularityLimit,
    )
    from mechlab.values import (
        Quantity,
        Range,
        Value,
    )

    __version__: str

_HOMES = {
    "mechlab.api": (
        "audit", "chart", "check", "claims", "compare", "cure", "cycle", "doctor", "draw", "edit", "environment", "environments",
        "explore", "fidelities", "find", "fit", "gallery", "generate", "generate_catalog", "linearize", "list_entries", "load",
        "load_recording", "modes", "optimize", "portrait", "run", "sensitivity", "session", "show", "simulate", "solve", "stability",
        "story", "studio", "sweep", "synthesize", "track", "view", "workspace",
    ),
    "mechlab.errors": ("EngineMissing", "LeftOutWarning", "MechlabError", "NoSolution", "Untrustworthy", "UsageError",),
    "mechlab.experiment.entry": ("Check", "Claim", "Entry", "ClaimResult", "CheckResult", "SceneRecipe", "Verdict",),
    "mechlab.experiment.laws": (
        "AppliedForce", "ComputedTorque", "Constant", "ConstantPower", "DcMotor", "FunctionLaw", "Harmonic", "Law", "Motor",
        "OneSidedStop", "Plant", "Servo", "TableLaw", "Viscous",
    ),
    "mechlab.experiment.model_file": ("LeftOut", "ModelFile"),
    "mechlab.experiment.motion": ("Hold", "Ramp", "Sine", "Spline"),
    "mechlab.experiment.parameters": ("parameter",),
    "mechlab.experiment.question": ("Answer", "Answers", "Question",),
    "mechlab.experiment.recording": ("Health", "Recording",),
    "mechlab.experiment.scene": ("PRESETS", "Scene", "Settings",),
    "mechlab.formats": (
        "from_json", "from_mjcf", "from_urdf", "save_recording", "to_json", "to_mjcf",
        "to_urdf",
    ),
    "mechlab.formats.exports": ("to_extended_urdf", "to_sdf", "to_usd"),
    "mechlab.lab.design": ("Design",),
    "mechlab.lab.own_mechanism": ("scene",),
    "mechlab.mechanism": (
        "GROUND", "Body", "Builder", "Drive", "Frame", "GearMesh", "Inertia", "Joint", "LinearRelation", "Loop",
        "Mechanism", "Placement", "Shaft", "Shape", "Spring", "Status", "belt", "floating", "mimic",
        "prismatic", "relation", "revolute", "screw", "spherical", "universal",
    ),
    "mechlab.mechanism.parts": ("LOOP_ROWS", "Control", "Winding"),
    "mechlab.shapes": ("shape",),
    "mechlab.studies.track.result": ("Track",),
    "mechlab.studies.track.tasks": (
        "CenterOfMassTask", "FrameTask", "PostureTask", "RangeLimit", "RateLimit", "SingularityLimit",
    ),
    "mechlab.values": ("Quantity", "Range", "Value",),
}  # fmt: skip
"""Module -> the public names that it holds; a test compares them with the imports above, which type checkers read."""
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "Answer", "Answers", "AppliedForce", "Body", "Builder", "CenterOfMassTask", "Check", "CheckResult", "Claim",
    "ClaimResult", "ComputedTorque", "Constant", "ConstantPower", "Control", "DcMotor", "Design", "Drive",
    "EngineMissing", "Entry", "Frame", "FrameTask", "FunctionLaw", "GROUND", "GearMesh", "Harmonic", "Health",
    "Hold", "Inertia", "Joint", "LOOP_ROWS", "Law", "LeftOut", "LeftOutWarning", "LinearRelation", "Loop",
    "Mechanism", "MechlabError", "ModelFile", "Motor", "NoSolution", "OneSidedStop", "PRESETS", "Placement", "Plant",
    "PostureTask", "Quantity", "Question", "Ramp", "Range", "RangeLimit", "RateLimit", "Recording", "Scene",
    "SceneRecipe", "Servo", "Settings", "Shaft", "Shape", "Sine", "SingularityLimit", "Spline", "Spring", "Status",
    "TableLaw", "Track", "Untrustworthy", "UsageError", "Value", "Verdict", "Viscous", "Winding", "__version__",
    "audit", "belt", "chart", "check", "claims", "compare", "cure", "cycle", "doctor", "draw", "edit", "environment", "environments",
    "explore", "fidelities", "find", "fit", "floating", "from_json", "from_mjcf", "from_urdf", "gallery", "generate",
    "generate_catalog", "linearize", "list_entries", "load", "load_recording", "mimic", "modes", "optimize",
    "parameter", "portrait", "prismatic", "relation", "revolute", "run", "save_recording", "scene", "screw",
    "sensitivity", "session", "shape", "show", "simulate", "solve", "spherical", "stability", "story", "studio",
    "sweep", "synthesize", "to_extended_urdf", "to_json", "to_mjcf", "to_sdf", "to_urdf", "to_usd", "track",
    "universal", "view", "workspace",
]  # fmt: skip


def __getattr__(name: str) -> object:
    """A public name, imported when it is asked for: `import mechlab` takes no time."""
    if name == "__version__":
        from importlib.metadata import version

        from mechlab.errors import DISTRIBUTION

        return version(DISTRIBUTION)
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    from mechlab.errors import nearest

    near = "" if name.startswith("_") else nearest(name, __all__)
    raise AttributeError(f"module 'mechlab' has no attribute {name!r}{near and f'. Did you mean {near!r}?'}")


def __dir__() -> list[str]:
    return sorted(__all__)
