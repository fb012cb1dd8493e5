"""Mechanisms: immutable data, a small numpy kinematics, structure analysis, assembly. No engine."""

from mechlab.mechanism.angle_basis import AngleBasis, dependent_angles
from mechlab.mechanism.assembly import close, mode_sign, same_mode
from mechlab.mechanism.builder import Builder
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.curve import Curve, CurveRelation, constant, hermite, joined, polynomial
from mechlab.mechanism.gears import GearMesh, belt, mimic, relation, screw
from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.kinematics import Kinematics, TreeKinematics, integrate
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly, Status, follow, newton
from mechlab.mechanism.parts import (
    GROUND,
    Body,
    Drive,
    Frame,
    Joint,
    LinearRelation,
    Loop,
    Shaft,
    Shape,
    Spring,
    Winding,
    as_fraction,
    floating,
    prismatic,
    revolute,
    shape,
    spherical,
    universal,
)
from mechlab.mechanism.reduction import Reduction, reduce
from mechlab.mechanism.singularity import singularity
from mechlab.mechanism.structure import Structure, structure
from mechlab.mechanism.tree import depth_first

__all__ = [
    "GROUND", "IDENTITY", "AngleBasis", "Assembly", "Body", "Builder", "ConstraintSet", "Curve", "CurveRelation", "Drive", "Frame",
    "GearMesh", "Inertia", "Joint", "Kinematics", "LinearRelation", "Loop", "Mechanism", "Placement", "Reduction", "Shaft", "Shape",
    "Spring", "Status", "Structure", "TreeKinematics", "Winding", "as_fraction", "belt", "close", "constant",
    "dependent_angles", "depth_first", "floating", "follow", "hermite", "integrate", "joined", "mimic", "mode_sign", "newton",
    "polynomial", "prismatic", "reduce", "relation", "revolute", "same_mode", "screw", "shape", "singularity", "spherical",
    "structure", "universal",
]  # fmt: skip
