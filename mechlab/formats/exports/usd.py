"""A Mechanism as USD with physics (UsdPhysics): rigid bodies with their masses, joints with limits and drives, and loops.

Loops are joints that are excluded from the articulation, as its tree cannot hold them. Metres, kilograms, z up; angles of
joints are in degrees, as UsdPhysics wants. The reference pose is that of the stage. A body with several joints gets links
between them with next to no mass (see `graph`). Needs the package usd-core: the extra [usd].
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

from mechlab.errors import EngineMissing, explained, install_extra
from mechlab.experiment.model_file import LeftOut
from mechlab.files import write
from mechlab.formats.exports.graph import Edge, Exported, JointGraph, Link, joint_graph, left_out_of
from mechlab.mechanism.geometry import Placement, frame_along
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Drive, Shape


def write_usd(m: Mechanism, folder: Path) -> Exported:
    """Write NAME.usda. Raises EngineMissing without usd-core."""
    write(folder / f"{m.name}.usda", to_usd(m))
    return Exported({"usd": Path(f"{m.name}.usda")}, usd_left_out(m))


def usd_left_out(m: Mechanism) -> tuple[LeftOut, ...]:
    """What of a mechanism its USD does not hold."""
    named = {j.name for j in m.joints}
    return left_out_of(
        m, "UsdPhysics",
        ("relation", [r.name for r in m.relations], "UsdPhysics has no gear or mimic"),
        ("drive", [d.name for d in m.drives if d.on not in named], "a shaft is no joint"),
        ("winding", [d.name for d in m.drives if d.winding], "UsdPhysics has no motor with a voltage"),
        ("joint spring", [j.name for j in m.joints if j.stiffness or j.damping or j.friction],
         "UsdPhysics has no spring, damping or friction of a joint beside a drive"),
    )  # fmt: skip


@explained
def to_usd(m: Mechanism) -> str:
    """The mechanism as USD text (.usda). Raises EngineMissing without usd-core."""
    try:
        from pxr import Usd
    except ImportError:
        raise EngineMissing(f"USD is written with usd-core, which is not installed; {install_extra('usd')}.") from None
    stage = Usd.Stage.CreateInMemory()
    _Writer(m, stage, joint_graph(m)).write()
    return str(stage.GetRootLayer().ExportToString())


class _Writer:
    """Writes one mechanism into a stage."""

    def __init__(self, m: Mechanism, stage: Any, graph: JointGraph) -> None:
        from pxr import Gf, UsdGeom, UsdPhysics

        self.m, self.stage, self.graph = m, stage, graph
        self.Gf, self.geom, self.physics = Gf, UsdGeom, UsdPhysics
        self.taken: set[str] = set()
        self.paths: dict[str, str] = {}

    def write(self) -> None:
        """The whole stage."""
        geom, physics = self.geom, self.physics
        geom.SetStageUpAxis(self.stage, geom.Tokens.z)
        geom.SetStageMetersPerUnit(self.stage, 1.0)
        physics.SetStageKilogramsPerUnit(self.stage, 1.0)
        self._gravity()
        self.top = "/" + self._name(self.m.name)
        root = geom.Xform.Define(self.stage, self.top)
        self.stage.SetDefaultPrim(root.GetPrim())
        physics.ArticulationRootAPI.Apply(root.GetPrim())
        for link in self.graph.links:
            self._link(link)
        for frame in self.m.frames:
            parent = self.paths[self.graph.link_of(frame.body).name]
            self._place(geom.Xform.Define(self.stage, f"{parent}/{self._name(frame.name)}"), frame.placement)
        drives = {d.on: d for d in self.m.drives if d.winding is None}
        geom.Scope.Define(self.stage, f"{self.top}/joints")
        for edge in self.graph.edges:
            self._joint(edge, drives.get(edge.joint.name) if edge.joint else None)

    def _gravity(self) -> None:
        scene = self.physics.Scene.Define(self.stage, "/" + self._name("physics"))
        size = math.sqrt(sum(g * g for g in self.m.gravity))
        scene.CreateGravityMagnitudeAttr(size)
        if size:
            scene.CreateGravityDirectionAttr(self.Gf.Vec3f(*(g / size for g in self.m.gravity)))

    def _name(self, name: str) -> str:
        """A prim name: letters, digits and underscores; different from all others."""
        clean = re.sub(r"\W", "_", name, flags=re.ASCII)
        clean = clean if not clean[0].isdigit() else f"_{clean}"
        while clean in self.taken:
            clean += "_"
        self.taken.add(clean)
        return clean

    def _place(self, prim: Any, placement: Placement) -> None:
        w, x, y, z = placement.quaternion
        prim.AddTranslateOp(self.geom.XformOp.PrecisionDouble).Set(self.Gf.Vec3d(*placement.position))
        prim.AddOrientOp(self.geom.XformOp.PrecisionDouble).Set(self.Gf.Quatd(w, x, y, z))

    def _link(self, link: Link) -> None:
        path = f"{self.top}/{self._name(link.name)}"
        self.paths[link.name] = path
        prim = self.geom.Xform.Define(self.stage, path)
        self._place(prim, link.placement)
        if link.body != GROUND:
            self.physics.RigidBodyAPI.Apply(prim.GetPrim())
            self._mass(prim.GetPrim(), link)
        for item in link.shapes:
            self._mesh(f"{path}/{self._name(item.name or item.kind)}", item)

    def _mass(self, prim: Any, link: Link) -> None:
        """Mass, centre and principal moments; their axes as a quaternion."""
        import numpy as np

        moments, axes = np.linalg.eigh(link.inertia.matrix())
        if np.linalg.det(axes) < 0:
            axes[:, 0] = -axes[:, 0]
        w, x, y, z = Placement.of(axes, (0.0, 0.0, 0.0)).quaternion
        api = self.physics.MassAPI.Apply(prim)
        api.CreateMassAttr(link.inertia.mass)
        api.CreateCenterOfMassAttr(self.Gf.Vec3f(*link.inertia.com))
        api.CreateDiagonalInertiaAttr(self.Gf.Vec3f(*(max(float(v), 0.0) for v in moments)))
        api.CreatePrincipalAxesAttr(self.Gf.Quatf(w, x, y, z))

    def _mesh(self, path: str, item: Shape) -> None:
        from mechlab.shapes import mesh

        made = mesh(item.kind, item.parameters)
        prim = self.geom.Mesh.Define(self.stage, path)
        self._place(prim, item.placement)
        prim.CreatePointsAttr([self.Gf.Vec3f(*p) for p in made.vertices.tolist()])
        prim.CreateFaceVertexCountsAttr([3] * len(made.faces))
        prim.CreateFaceVertexIndicesAttr(made.faces.reshape(-1).tolist())
        prim.CreateSubdivisionSchemeAttr(self.geom.Tokens.none)
        prim.CreateDisplayColorAttr([self.Gf.Vec3f(*item.color[:3])])
        if item.color[3] < 1.0:
            prim.CreateDisplayOpacityAttr([item.color[3]])

    def _joint(self, edge: Edge, drive: Drive | None) -> None:
        kinds = {
            "revolute": self.physics.RevoluteJoint, "prismatic": self.physics.PrismaticJoint,
            "spherical": self.physics.SphericalJoint, "fixed": self.physics.FixedJoint,
            "distance": self.physics.DistanceJoint,
        }  # fmt: skip
        joint = kinds[edge.kind].Define(self.stage, f"{self.top}/joints/{self._name(edge.name)}")
        turn = Placement.of(frame_along(edge.axis), (0.0, 0.0, 0.0))
        second = edge.other if edge.kind == "distance" else edge.placement
        for link, at, body, position, rotation in (
            (edge.parent, edge.placement, joint.CreateBody0Rel, joint.CreateLocalPos0Attr, joint.CreateLocalRot0Attr),
            (edge.child, second, joint.CreateBody1Rel, joint.CreateLocalPos1Attr, joint.CreateLocalRot1Attr),
        ):
            body().SetTargets([self.paths[link]])
            local = self.graph.placed(link).inverse() @ at @ turn
            position(self.Gf.Vec3f(*local.position))
            rotation(self.Gf.Quatf(*local.quaternion))
        if edge.closes:
            joint.CreateExcludeFromArticulationAttr(True)
        if edge.kind == "distance":
            joint.CreateMinDistanceAttr(edge.length)
            joint.CreateMaxDistanceAttr(edge.length)
        if edge.kind in ("revolute", "prismatic"):
            joint.CreateAxisAttr("Z")
            self._limits(joint, edge)
            if drive is not None:
                self._drive(joint, edge, drive)

    def _limits(self, joint: Any, edge: Edge) -> None:
        if edge.joint is None or edge.joint.range is None:
            return
        low, high = (self._unit(edge) * (x - edge.joint.zero) for x in edge.joint.range)
        joint.CreateLowerLimitAttr(low)
        joint.CreateUpperLimitAttr(high)

    def _drive(self, joint: Any, edge: Edge, drive: Drive) -> None:
        """A force drive; of a revolute joint its stiffness [N m/deg], damping and target are in degrees."""
        assert edge.joint is not None
        unit = self._unit(edge)
        api = self.physics.DriveAPI.Apply(joint.GetPrim(), "angular" if edge.kind == "revolute" else "linear")
        api.CreateTypeAttr("force")
        api.CreateStiffnessAttr(drive.stiffness / unit)
        api.CreateDampingAttr(drive.damping / unit)
        if drive.limit is not None:
            api.CreateMaxForceAttr(drive.limit)
        if drive.stiffness:
            target = edge.joint.zero if drive.target is None else drive.target
            api.CreateTargetPositionAttr(unit * (target - edge.joint.zero))

    def _unit(self, edge: Edge) -> float:
        return math.degrees(1.0) if edge.kind == "revolute" else 1.0
