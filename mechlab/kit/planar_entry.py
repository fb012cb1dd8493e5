"""Makes the parts of an entry from a planar linkage of dyads: build, question, scenes, closed-form recording,
checks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from mechlab.analytic.linkage import Linkage, Motion
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.entry import Check, CheckResult, SceneRecipe
from mechlab.experiment.laws import ComputedTorque
from mechlab.experiment.motion import PrescribedMotion, Ramp, Sine
from mechlab.experiment.question import Answer, Question, with_rates
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit import mass_check
from mechlab.kit.checks import by_witnesses, closed_form_recording, driven_run
from mechlab.kit.planar_build import Style, coordinates, mechanism_of
from mechlab.kit.planar_mass import compare_planar
from mechlab.kit.questions import RATES, by_engines, not_assembled, with_orders
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism, Status
from mechlab.mechanism.geometry import Array

START_OFFSET = 1e-3
"""Offset of every coordinate of the engines' start from the closed form: small enough for the same mode, but no
answer."""
DRIVEN = Settings(timeconst=4.0)
"""Settings of driven cranks: softer rows follow a commanded acceleration with less ringing."""
FREE = Settings(timestep=2.5e-4)
"""Settings of free motion: by the estimated step error, this timestep meets the tolerance."""

NORMAL = 0.5
"""Size of a mechanism [m] up to which the tolerance of a scene is that of its angles."""


def scale(mechanism: Mechanism) -> float:
    """Factor of the tolerance of a scene: errors of lengths grow with the mechanism."""
    return max(1.0, mechanism.size / NORMAL)


@dataclass(frozen=True)
class Planar:
    """A planar linkage as an entry. linkage(p): the chain in the assembly modes of the parameters; start(p): crank ->
    angle of the reference pose [rad]; style(p): masses and dimensions; speeds(p): crank -> rate of the driven scene
    [rad/s]. points, links, slides: those that the question answers. finish(p, builder): adds springs and the like before the
    reference pose is closed. motions(p): crank -> its motion in the driven scene, instead of an even turn. timestep: of that scene [s];
    released: duration of the free one [s]."""

    name: str
    summary: str
    linkage: Callable[[Any], Linkage]
    start: Callable[[Any], dict[str, float]]
    style: Callable[[Any], Style]
    speeds: Callable[[Any], dict[str, float]]
    points: tuple[str, ...] = ()
    cranks: tuple[str, ...] = ("crank",)
    links: tuple[str, ...] = ()
    slides: tuple[str, ...] = ()
    finish: Callable[[Any, Builder], object] | None = None
    motions: Callable[[Any], dict[str, PrescribedMotion]] | None = None
    timestep: float = DRIVEN.timestep
    released: float = 2.0

    # -- the mechanism -------------------------------------------------------------------------------------------------

    def build(self, p: Any, fidelity: str) -> Mechanism:
        """The mechanism, its reference pose at the start angles."""
        return _built(self, p)

    # -- the question --------------------------------------------------------------------------------------------------

    @property
    def given(self) -> tuple[str, ...]:
        """Keys of the question: the crank angles."""
        return tuple(f"{c}_angle" for c in self.cranks)

    @property
    def quantities(self) -> dict[str, str]:
        """Answer -> name of the quantity in the engines; rates and accelerations are answered too."""
        own = {f"{n}_angle": f"{n}_angle" for n in self.links} | {f"{n}_slide": f"{n}_slide" for n in self.slides}
        return own | {f"{n}_{a}": f"{n}_{b}" for n in self.points for a, b in (("x", "x"), ("y", "z"))}

    def question(self) -> Question:
        """The question for all moving parts from crank angles, rates and accelerations, by three witnesses."""
        optional: dict[str, float | None] = {f"{c}{s}": 0.0 for c in self.cranks for s in ("_rate", "_accel")}
        given = {f"{c}_angle": f"{c}_angle" for c in self.cranks}
        given |= {f"{c}{s}": f"{c}_angle{s}" for c in self.cranks for s in ("_rate", "_accel")}
        answers = with_orders(self.quantities)
        return Question(
            "pose", given=self.given, optional=optional, answers=tuple(answers),
            witnesses={"analytic": self._analytic} | by_engines(self.build, given, answers, self._start),
            angles=tuple(f"{n}_angle" for n in self.links), units=self._units(),
            text="positions, rates and accelerations of all links from those of the cranks; every assembly mode",
        )  # fmt: skip

    def _units(self) -> dict[str, str]:
        cranks = {
            f"{c}{s}": f"rad{per}"
            for c in self.cranks
            for s, per in (("_angle", ""), ("_rate", "/s"), ("_accel", "/s2"))
        }
        return cranks | with_rates({n: "rad" if n.endswith("_angle") else "m" for n in self.quantities})

    def inputs(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Inputs of the linkage from the keys of the question."""
        return {
            c: (given[f"{c}_angle"], given.get(f"{c}_rate", 0.0), given.get(f"{c}_accel", 0.0)) for c in self.cranks
        }

    def values(self, motion: Motion) -> dict[str, Any]:
        """The answers from a motion."""
        out: dict[str, Any] = {}
        for kind, names, table in (("angle", self.links, motion.turns), ("slide", self.slides, motion.slides)):
            for n in names:
                s = table[n]
                out |= {f"{n}_{kind}": s.x, f"{n}_{kind}_rate": s.v, f"{n}_{kind}_accel": s.a}
        for n in self.points:
            z = motion.points[n]
            for a, part in (("x", np.real), ("y", np.imag)):
                out |= {f"{n}_{a}{o}": part(w) for o, w in zip(RATES, (z.p, z.v, z.a), strict=True)}
        return out

    def _analytic(self, p: Any, given: Mapping[str, Any]) -> Answer:
        chain, inputs = self.linkage(p), self.inputs(given)
        motion = chain.solve(**inputs)
        scalar = all(np.ndim(x) == 0 for v in inputs.values() for x in v)
        listed = _listed(self, chain, inputs) if scalar else ()
        for name, dyad in motion.dyads.items():
            if not np.all(dyad.assembles):
                return not_assembled(f"group {name} ({dyad.kind}) is", dyad.gap, dyad.assembles, listed)
        dead = [n for n, d in motion.dyads.items() if not np.all(d.regular)]
        if dead:
            text = f"group {', '.join(dead)} stands at a dead centre, where two modes meet: rates do not exist"
            places = {k: v for k, v in self.values(motion).items() if not k.endswith(("_rate", "_accel"))}
            return Answer(places, Status.BOUNDARY, (text,), modes=listed)
        quality = {f"quality_{n}": d.quality for n, d in motion.dyads.items()}
        return Answer(self.values(motion) | quality, modes=listed)

    def _start(self, p: Any, m: Mechanism, given: Mapping[str, Any]) -> Array | None:
        """Coordinates (nq,) of the closed form plus START_OFFSET; None where it does not assemble."""
        chain = self.linkage(p)
        motion = chain.solve(**self.inputs(given))
        if not all(np.all(d.assembles) for d in motion.dyads.values()):
            return None
        return np.asarray(coordinates(m, chain, motion, self.style(p))[0][0] + START_OFFSET)

    # -- scenes --------------------------------------------------------------------------------------------------------

    def scenes(self) -> dict[str, SceneRecipe]:
        """Scene driven-crank: every crank turns at constant rate by inverse dynamics; free-run: released at that
        rate."""

        def make(name: str) -> Callable[[Any, str], Scene]:
            def scene(p: Any, fidelity: str) -> Scene:
                moves = self._driven(p)
                start, speed = ({n: float(m.at(0.0)[k]) for n, m in moves.items()} for k in (0, 1))
                law = ComputedTorque(tuple(start), tuple(moves.items()), ((1e4, 200.0),) * len(start))
                laws = (law,) if name == "driven-crank" else ()
                turn = max((_period(m) for m in moves.values()), default=1.0)
                grown = scale(self.build(p, fidelity))
                if laws:
                    settings = replace(DRIVEN, timestep=self.timestep)
                    return Scene(name, fidelity, turn, laws, start, speed, tolerance=1e-5 * grown, settings=settings)
                return Scene(name, fidelity, self.released, (), start, speed, tolerance=1e-4 * grown, settings=FREE, drives="free")

            return scene

        return {
            "driven-crank": SceneRecipe(
                make("driven-crank"), "minimal", "the cranks turn steadily, by inverse dynamics"
            ),
            "free-run": SceneRecipe(
                make("free-run"), "minimal", "the cranks are let go at the speed of the driven scene"
            ),
        }

    def _driven(self, p: Any) -> dict[str, PrescribedMotion]:
        if self.motions:
            return {f"{c}_angle": m for c, m in self.motions(p).items()}
        speeds = self.speeds(p)
        return {f"{c}_angle": Ramp(a, speeds[c]) for c, a in self.start(p).items()}

    def reference(self, p: Any, scene: Scene) -> Recording:
        """The driven scene in closed form. Raises MechlabError for any other scene."""
        law = scene.laws[0] if scene.laws else None
        if not isinstance(law, ComputedTorque):
            raise MechlabError(f"{self.name}: scene {scene.name!r} has no closed form; engines: mujoco, pinocchio.")
        m, chain = self.build(p, "minimal"), self.linkage(p)
        t = np.linspace(0.0, scene.duration, 1441)
        inputs: dict[str, Any] = {}
        for name, motion in law.commands:
            inputs[name.removesuffix("_angle")] = tuple(np.array([motion.at(float(x)) for x in t]).T)
        return closed_form_recording(
            m, scene, t, *coordinates(m, chain, chain.solve(**inputs).require(), self.style(p))
        )

    # -- checks --------------------------------------------------------------------------------------------------------

    def checks(self, letter: str) -> tuple[Check, ...]:
        """Three checks: positions, rates and accelerations by three witnesses; a driven run of MuJoCo against the
        closed form; masses, momenta, energy and power of moving states."""
        source = "closed form, dyads"
        return (
            Check(f"{letter}1", "positions, rates, accelerations from three witnesses", self._check_pose, source),
            Check(f"{letter}2", "a driven run of MuJoCo against the closed form", self._check_run, source, slow=True),
            Check(f"{letter}3", mass_check.TEXT, self._check_mass, mass_check.SOURCE),
        )

    def _check_mass(self, p: Any) -> CheckResult:
        start = self.start(p)
        rates = {c: 1.3 - 0.4 * k for k, c in enumerate(self.cranks)}
        positions = [{c: (start[c] + turn, rates[c], 0.0) for c in self.cranks} for turn in (0.0, 0.2)]
        return compare_planar(self.build(p, "minimal"), self.linkage(p), positions, self.style(p))

    def _check_pose(self, p: Any) -> CheckResult:
        start, given = self.start(p), list[dict[str, Any]]()
        for k in range(5):
            given.append({})
            for i, c in enumerate(self.cranks):
                given[k] |= {f"{c}_angle": start[c] + 0.11 * k * (-1) ** i, f"{c}_rate": 1.3, f"{c}_accel": -0.7}
        motion = self.linkage(p).solve(**self.inputs({name: np.array([x[name] for x in given]) for name in given[0]}))
        solved = np.ones(len(given), dtype=bool)
        for dyad in motion.dyads.values():
            solved &= dyad.assembles & dyad.regular
        if not solved[0]:  # later ones may lie beyond a limit
            raise NoSolution(f"{self.name}: it does not assemble at the start: {'; '.join(self._analytic(p, given[0]).notes)}")
        sample = [x for x, good in zip(given, solved, strict=True) if good]
        note = f"{len(sample)} poses near the start: all quantities with rates and accelerations"
        return by_witnesses(p, self.question(), sample, 1e-8, note)

    def _check_run(self, p: Any) -> CheckResult:
        scene = self.scenes()["driven-crank"].make(p, "minimal")
        return driven_run(self.build(p, "minimal"), scene, self.reference, p, 0.37)


def _period(motion: PrescribedMotion) -> float:
    """The time of a turn or of a swing there and back [s]; 1 of what stands still."""
    speed = motion.frequency if isinstance(motion, Sine) else abs(motion.at(0.0)[1])
    return 2.0 * np.pi / speed if speed else 1.0


@lru_cache(maxsize=64)
def _built(kit: Planar, p: Any) -> Mechanism:
    finish = kit.finish
    more = (lambda b: finish(p, b)) if finish else None
    return mechanism_of(kit.linkage(p), kit.start(p), kit.style(p), kit.summary, finish=more)


def _listed(kit: Planar, chain: Linkage, inputs: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
    out = []
    for chosen, motion in chain.modes(**inputs):
        label = " ".join(f"{n}{'+' if s > 0 else '-'}" for n, s in chosen.items()) or "only"
        out.append({"label": label} | {k: float(v) for k, v in kit.values(motion).items() if np.isfinite(v)})
    return tuple(out)
