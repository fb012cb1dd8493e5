"""Witnesses of the page's solver: Pinocchio's closure, small steps in Python, signs of determinants by numpy."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

import mechlab as ml
from mechlab.engines.pinocchio.closer import Closer
from mechlab.mechanism import Builder, ConstraintSet, Inertia, Mechanism, TreeKinematics, prismatic, revolute, spherical
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import integrate
from mechlab.mechanism.newton import newton
from mechlab.mechanism.structure import generic, independent_rows, null_space, structure
from mechlab.shapes import shape

MECHANISMS = (
    ("delta6", "full"), ("class4_linkage", None), ("platform_3rrr", None), ("bricard", None), ("planetary", "full"),
    ("gear_linkage", None), ("fourbar", None), ("quick_return", None), ("stephenson", None), ("fivebar", None),
    ("slider_crank", None), ("lift", None), ("cam_follower", None), ("geneva", None),
)  # fmt: skip
"""Names and fidelities (None: the default); "lift" is `lift()`."""


def lift() -> Mechanism:
    """A spatial mechanism of two freedoms: a crank, a ball and a cross joint, a swinging slide with a range, a strut, a gear."""
    b = Builder("lift")
    solid = Inertia.box(0.2, 0.1, 0.02, 0.02)
    b.body("crank", revolute("crank_angle", "x"), inertia=solid)
    b.body("coupler", spherical("ball"), parent="crank", at=(0.0, 0.08, 0.0), inertia=solid)
    b.body("rocker", prismatic("reach", "z", range=(-0.05, 0.06)), revolute("swing", "y"), at=(0.3, 0.05, 0.0), inertia=solid)
    b.body("carriage", prismatic("travel", "x"), at=(0.25, -0.1, 0.02), inertia=solid)
    b.loop("cross", "coupler", "rocker", (0.3, 0.0, 0.0), (0.0, 0.0, 0.1), kind="universal", axis_a="z", axis_b="y")
    b.loop("strut", "carriage", "rocker", at_b=(0.0, 0.0, 0.05), kind="distance", length=0.2)
    wheel = shape("disc", radius=0.03, thickness=0.01)
    b.shaft("wheel", {"crank_angle": "17/5"}, shapes=(wheel,))
    b.drive("crank_angle").drive("reach")
    return b.assemble({"crank_angle": 0.4, "swing": 0.2}, hold=("crank_angle", "reach"))


def mechanism_of(name: str, fidelity: str | None) -> Mechanism:
    """A mechanism of MECHANISMS."""
    return lift() if name == "lift" else ml.load(name).mechanism(fidelity)


@dataclass
class Witness:
    """Checks what the page's solver says of one mechanism. Every check raises AssertionError."""

    m: Mechanism
    drives: tuple[str, ...]

    @cached_property
    def constraints(self) -> ConstraintSet:
        return ConstraintSet(self.m)

    @cached_property
    def keep(self) -> list[int]:
        return independent_rows(self.m, self.constraints)

    @cached_property
    def closer(self) -> Closer:
        return Closer(self.m, self.drives)

    @cached_property
    def rigid(self) -> list[str]:
        """Bodies that no local freedom moves."""
        idle = {n.removeprefix("spin of ") for n in structure(self.m).idle}
        return [b.name for b in self.m.bodies if b.name not in idle]

    @cached_property
    def size(self) -> float:
        return self.m.size or 1.0

    @cached_property
    def scale(self) -> Array:
        """(nv,) length of a unit of each rate: 1 for turns, the size for slides."""
        out = np.ones(self.m.nv)
        for joint in self.m.joints:
            if joint.kind == "prismatic":
                out[self.m.v_slice[joint.name]] = self.size
        return out

    def wish(self, rng: np.random.Generator, q: Array) -> dict[str, Any]:
        """A random position of one slider while the other drives hold, or a drag."""
        if rng.random() < 0.5:
            values = {n: float(self.m.value(n, q)) for n in self.drives}
            name = str(rng.choice(self.drives))
            slides = next((j.kind == "prismatic" for j in self.m.joints if j.name == name), False)
            home = float(self.m.value(name, self.m.reference()))
            return {"drives": values | {name: home + rng.uniform(-1.0, 1.0) * (0.3 * self.size if slides else 2.0)}}
        return self.drag(rng, q)

    def drag(self, rng: np.random.Generator, q: Array) -> dict[str, Any]:
        """A body drawn by up to a tenth of the size in each direction."""
        body = str(rng.choice([b.name for b in self.m.bodies]))
        point = rng.uniform(-0.05, 0.05, 3) * self.size
        rotation, origin = TreeKinematics(self.m, q).pose(body)
        target = origin + rotation @ point + rng.uniform(-0.1, 0.1, 3) * self.size
        return {"grab": {"body": body, "point": point.tolist(), "target": target.tolist()}}

    # -- checks ------------------------------------------------------------------------------------------------------

    def check(self, before: Array, wish: dict[str, Any], report: dict[str, Any]) -> None:
        """Everything that holds after any wish."""
        m, q = self.m, np.array(report["q"])
        gap = np.abs(self.constraints.residual(TreeKinematics(m, q))).max(initial=0.0)
        assert report["closed"], "closed"
        assert gap < 1e-9 * max(self.size, 1e-3), f"gap {gap}"
        assert abs(report["gap"] - gap) < 1e-13 + 1e-12 * self.size
        for name, value in report["values"].items():
            assert abs(value - float(m.value(name, q))) < 1e-11 * max(1.0, abs(value)), name
        if report["closeness"] > 1e-4:  # nearer to a singular pose the drives do not determine it to the digits compared
            self.check_pinocchio(q, report["closeness"])
        if not report["stops"]:
            for name, value in wish.get("drives", {}).items():
                assert abs(report["values"][name] - value) < 1e-11 * max(1.0, abs(value)), f"{name} is not at its target"
        for stop in report["stops"]:
            self.check_stop(q, before, stop)
        if "drives" in wish:
            assert not report["modeChanged"]
            if self.distance(before) > 1e-4:  # from a limit position the drives alone do not tell which way the mechanism goes
                self.check_small_steps(before, q)
        elif report["closeness"] > 1e-6:
            a, b = self.mode(before), self.mode(q)
            assert not a or not b or (a != b) == report["modeChanged"], "mode"

    def check_pinocchio(self, q: Array, closeness: float) -> None:
        """Pinocchio's closure at the same drives, from a pose nearby, comes to the same poses."""
        targets = self.closer.values(q)
        push = np.random.default_rng(3).standard_normal(self.m.nv) * 1e-3 * min(1.0, 10.0 * closeness) * self.scale
        found = newton(lambda x: self.closer.evaluate(x, targets), self.closer.step, integrate(self.m, q, push))
        assert found.residual < 1e-10, f"Pinocchio does not close: {found.residual}"
        off = self.apart(q, found.q)
        # the residuals of both are about 1e-13; the poses differ by that over the closeness
        assert off < 1e-8, f"{off} from Pinocchio, closeness {closeness}"

    def apart(self, a: Array, b: Array) -> float:
        """Largest difference of poses, lengths in sizes, of the bodies that no local freedom moves."""
        first, second = (TreeKinematics(self.m, x) for x in (a, b))
        worst = 0.0
        for name in self.rigid:
            (ra, pa), (rb, pb) = first.pose(name), second.pose(name)
            worst = max(worst, float(np.abs(pa - pb).max()) / self.size, float(np.abs(ra - rb).max()))
        return worst

    def check_small_steps(self, before: Array, q: Array) -> None:
        """The same way of the drives in small steps of Newton's method in Python ends at the same pose."""
        m, tree = self.m, TreeKinematics(self.m)
        rows = np.array([m.row(n) for n in self.drives])
        first, last = (np.array([m.value(n, x) for n in self.drives]) for x in (before, q))

        def evaluate(x: Array, s: float) -> tuple[Array, Array]:
            tree.set(x)
            now = np.array([m.value(n, x) for n in self.drives])
            residual = np.concatenate([self.constraints.residual(tree), now - first - s * (last - first)])
            return residual, np.vstack([self.constraints.jacobian(tree), rows])

        longest = 1.0 / (20 + int(100.0 * np.abs((last - first) @ rows / self.scale).max()))
        q_now, s, step = before, 0.0, longest
        while s < 1.0 and step > 1e-9:  # never longer: two modes may be near each other
            ahead = min(1.0, s + step)
            found = newton(partial(evaluate, s=ahead), partial(integrate, m), q_now, iterations=12)
            if found.closed and np.abs(found.q - q_now).max() < 0.1:
                q_now, s, step = found.q, ahead, min(longest, 1.5 * step)
            else:
                step *= 0.5
        # at a limit position the drives determine the pose only to the root of their rounding
        ended, close = self.apart(q, q_now), 1e-7 if self.distance(q) > 1e-3 else 1e-3
        assert ended < close, f"small steps end {ended} apart, at {s:.3f} of the way"

    def rows(self, q: Array) -> Array:
        """Scaled independent closure rows and rows of the drives."""
        jacobian = self.constraints.jacobian(TreeKinematics(self.m, q))[self.keep]
        return np.asarray(np.vstack([jacobian, *[self.m.row(n)[None] for n in self.drives]]) * self.scale / self.sizes[:, None])

    @cached_property
    def sizes(self) -> Array:
        """Sizes of the rows at a pose of full rank: one that vanishes elsewhere is seen."""
        jacobian = generic(self.m)[1][self.keep]
        matrix = np.vstack([jacobian, *[self.m.row(n)[None] for n in self.drives]]) * self.scale
        return np.asarray(np.linalg.norm(matrix, axis=1))

    def distance(self, q: Array) -> float:
        """Smallest singular value of the closure with the drives held."""
        return float(np.linalg.svd(self.rows(q), compute_uv=False)[-1])

    def mode(self, q: Array) -> int:
        """Sign of the determinant with the drives held; 0 where it cannot tell: the matrix is not square, or rows repeat others
        in a way that changes with the pose."""
        matrix = self.rows(q)
        changing = any(x.combination for x in structure(self.m).redundant)
        return 0 if changing or matrix.shape[0] != matrix.shape[1] else int(np.linalg.slogdet(matrix)[0])

    def check_stop(self, q: Array, before: Array, stop: dict[str, str]) -> None:
        """A range is at its end, a limit position is singular for the drives."""
        name, why = stop["name"], stop["why"]
        if why == "range":
            joint = self.m.joint(name)
            value = float(self.m.value(name, q)) if joint.nv == 1 else None
            assert joint.range is not None and value is not None
            assert min(abs(value - x) for x in joint.range) < 1e-9 * max(1.0, abs(value)), stop
        elif why in ("fold", "singular"):
            assert self.distance(q) < 2e-2, f"{stop} at a distance of {self.distance(q)}"
        else:
            raise AssertionError(f"nothing is locked: {stop}")

    def check_stationary(self, q: Array, grab: dict[str, Any], active: list[str]) -> None:
        """The point can come no nearer to its target on the closed poses, to first order (Karush, Kuhn and Tucker)."""
        tree = TreeKinematics(self.m, q)
        rotation, origin = tree.pose(grab["body"])
        here = origin + rotation @ np.array(grab["point"])
        offset = (np.array(grab["target"]) - here) / self.size
        gradient = (tree.jacobian(grab["body"], here)[:3] * self.scale / self.size).T @ offset
        held = [self.m.row(n)[None] * self.scale for n in active]
        free = null_space(np.vstack([self.constraints.jacobian(tree) * self.scale, *held]))
        assert float(np.linalg.norm(free.T @ gradient)) < 1e-5, "not stationary"
