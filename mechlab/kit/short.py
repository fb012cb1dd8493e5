"""Entries in the short form: a linkage of dyads, or a Builder, the path of its drives, and a number from outside.

    ENTRY = planar_entry("hoeken", "Hoeken's linkage", "straight-line", parameters=Parameters, linkage=linkage,
                         path=lambda p: {"crank_angle": (0.0, 6.28)}, outside=(Outside(...),), ...)

Scenes, question and checks follow: poses and rates along the path by every witness, the number from outside by every witness, a
driven run of MuJoCo against the closed form or against Pinocchio.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from mechlab.analytic.linkage import Linkage
from mechlab.engines.protocol import WITNESSES, engine
from mechlab.experiment.entry import Check, CheckResult, Entry, Outside, PlotRecipe, SceneRecipe
from mechlab.experiment.laws import ComputedTorque
from mechlab.experiment.motion import PrescribedMotion, Ramp, Sine
from mechlab.experiment.parameters import parameter
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.path_motion import ClosedMotion, EngineMotion, NotInClosedForm, Path, kept
from mechlab.kit.planar_build import Style, angle_name
from mechlab.kit.planar_entry import DRIVEN, FREE, Planar, scale
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism
from mechlab.mechanism.geometry import Array

__all__ = [
    "Bars", "Linkage", "Motion", "Outside", "PlotRecipe", "alike", "always", "builder_entry", "each", "ends", "farthest", "parameter",
    "planar_entry", "point_at", "ratio", "speeds", "value_at",
]  # fmt: skip

PLACES = 25
"""Places of the path at which poses are compared and numbers are read off."""
GAINS = (1e4, 200.0)
"""Position gain [1/s2] and velocity gain [1/s] of the drives in the scene driven."""

EVEN, SWING = 1e-10, 1e-6
"""Tolerances of Pinocchio's driven run: in an even turn its error is about the tolerance; in a swing the gains keep the steps so short that
it is 1e-10."""


@dataclass(frozen=True)
class Bars:
    """What the parameters of every planar entry share; give the lengths in a dataclass below it."""

    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    speed: float = parameter(6.0, "rad/s", "speed of the drive in the scenes")


def farthest(values: Array, target: float) -> float:
    """The one of the values (n,) that is farthest from the target."""
    return float(values[np.argmax(np.abs(values - target))])


def value_at(
    name: str, expected: Callable[[Any], float], source: str, place: int = -1, text: str = "", unit: str = "m", tolerance: float = 1e-9
) -> Outside:
    """The number from outside that is the value of one quantity at a place of the path, by default its end."""
    said = text or f"{name} at {'the end' if place == -1 else f'place {place} of the path'}"
    return Outside(said, unit, expected, lambda p, motion: float(motion[name][place]), tolerance, source)


def always(
    text: str, unit: str, value: Callable[[Any, Motion], Array], expected: Callable[[Any], float], source: str,
    tolerance: float = 1e-8,
) -> Outside:  # fmt: skip
    """The number from outside that value(p, motion) (n,) has all along the path: where it is farthest from it."""
    return Outside(text, unit, expected, lambda p, m: farthest(value(p, m), expected(p)), tolerance, source)


def alike(a: str, b: str, source: str, factor: float = 1.0, unit: str = "rad") -> Outside:
    """The number from outside that a - factor b is 0 all along the path."""
    said = f"{a} {'-' if factor > 0 else '+'} {'' if abs(factor) == 1 else f'{abs(factor):g} '}{b}, where it is farthest from 0"
    return always(said, unit, lambda p, m: m[a] - factor * m[b], lambda p: 0.0, source)


def point_at(name: str, expected: Callable[[Any], complex], source: str, place: int = -1) -> tuple[Outside, Outside]:
    """The numbers from outside that are the place of a point of a planar linkage, x + i z, at a place of the path."""
    x = value_at(f"{name}_x", lambda p: expected(p).real, source, place)
    return x, value_at(f"{name}_z", lambda p: expected(p).imag, source, place)


def speeds(a: str, b: str, expected: Callable[[Any], float], source: str, place: int = 0, text: str = "", unit: str = "") -> Outside:
    """The number from outside that is the rate of a over that of b at a place of the path."""
    said = text or f"rate of {a} over that of {b} at {'the start' if place == 0 else f'place {place} of the path'}"
    return Outside(said, unit, expected, lambda p, m: ratio(m, a, b, place), 1e-9, source)


Motion = Mapping[str, Array]
"""Quantities (n,) by name along a path."""


def each(form: Callable[[Any, Mapping[str, float]], Mapping[str, float]]) -> Callable[[Any, Motion], Motion]:
    """A closed form of a whole path from one of a single place: form(p, drive -> value) -> quantity -> value."""

    def closed(p: Any, given: Motion) -> Motion:
        rows = [form(p, dict(zip(given, row, strict=True))) for row in np.column_stack(list(given.values())).tolist()]
        return {n: np.array([row[n] for row in rows]) for n in rows[0]}

    return closed


def ends(
    form: Callable[[Any, Mapping[str, float]], Mapping[str, float]], path: Path, names: Sequence[str], source: str, unit: str = "rad"
) -> tuple[Outside, ...]:
    """The numbers from outside that are quantities of a closed form, as of `each`, at the end of the path."""
    last = {n: b for n, (_, b) in path.items()}

    def value(p: Any, name: str) -> float:
        return form(p, last)[name]

    return tuple(value_at(n, partial(value, name=n), source, unit=unit) for n in names)


def ratio(motion: Motion, a: str, b: str, place: int = 12, less: str = "") -> float:
    """Rate of a over that of b at a place of the path, both less that of another quantity if one is given."""
    base = float(motion[f"{less}_rate"][place]) if less else 0.0
    return float((motion[f"{a}_rate"][place] - base) / (motion[f"{b}_rate"][place] - base))


def planar_entry(
    name: str,
    title: str,
    family: str,
    *,
    summary: str,
    use: str,
    origin: str,
    parameters: type[Any],
    linkage: Callable[[Any], Linkage],
    path: Callable[[Any], Path],
    outside: Sequence[Outside],
    width: Callable[[Any], float],
    links: tuple[str, ...] = (),
    points: tuple[str, ...] = (),
    slides: tuple[str, ...] = (),
    plots: Sequence[PlotRecipe] = (),
    sliders: tuple[str, ...] = (),
    finish: Callable[[Any, Builder], object] | None = None,
    servo: tuple[float, float] = (200.0, 2.0),
    timestep: float = DRIVEN.timestep,
    released: float = 2.0,
    chain: str = "",
    formulas: str = "",
    sources: tuple[str, ...] = (),
) -> Entry:
    """An Entry of a planar linkage of dyads, groups of class III or IV, and geared cranks; its parameters are `Bars`.

    path(p): crank angle -> first and last value [rad]; the reference pose is its beginning. width(p) [m] of the bars. links, points,
    slides: those that the question answers. finish(p, builder) adds springs and the like. servo: stiffness [N m/rad] and damping
    [N m s/rad] of the drives. timestep: of the driven scene [s]; released: duration of the free one [s], short of a flat pose, from which
    more than one way leads on. outside: see `Outside`; the motion of each witness has the names of the engines (points POINT_x, POINT_z).
    """

    def start(p: Any) -> dict[str, float]:
        return {n.removesuffix("_angle"): float(a) for n, (a, _) in path(p).items()}

    def speeds(p: Any) -> dict[str, float]:
        return {n.removesuffix("_angle"): float(np.copysign(p.speed, b - a)) for n, (a, b) in path(p).items()}

    def style(p: Any) -> Style:
        return Style(p.mass_per_length, gravity=p.gravity, width=width(p), drive_stiffness=servo[0], drive_damping=servo[1])

    def motions(p: Any) -> dict[str, PrescribedMotion]:
        return {n.removesuffix("_angle"): _at_speed(a, b, p.speed) for n, (a, b) in path(p).items()}

    cranks = tuple(linkage(parameters()).inputs)
    kit = Planar(name, summary, linkage, start, style, speeds, points, cranks, links, slides, finish, motions, timestep, released)

    def closed(p: Any) -> ClosedMotion:
        return _closed_motion(kit, p, path(p))

    short = _Short(name, kit.build, "minimal", path, closed)
    return Entry(
        name=name, title=title, summary=summary, parameters=parameters, build=kit.build,
        fidelities={"kinematic": "closed form", "minimal": "bars and pins; exact dynamics"}, default_fidelity="minimal",
        scenes=kit.scenes(), default_scene="driven-crank", sliders=sliders, plots=tuple(plots), questions=(kit.question(),),
        checks=(*kit.checks("K"), *short.outside_checks(outside)), reference=kit.reference, chain=chain, formulas=formulas,
        sources=sources, family=family, origin=origin, use=use, outside=tuple(outside), path=path,
    )  # fmt: skip


def builder_entry(
    name: str,
    title: str,
    family: str,
    *,
    summary: str,
    use: str,
    origin: str,
    parameters: type[Any],
    build: Callable[[Any], Mechanism],
    path: Callable[[Any], Path],
    outside: Sequence[Outside],
    closed: Callable[[Any, Mapping[str, Any]], Mapping[str, Any]] | None = None,
    drives: tuple[str, ...] = (),
    through: Callable[[Any], Sequence[float]] = lambda p: (),
    duration: float = 1.0,
    timestep: float = DRIVEN.timestep,
    released: float = 0.0,
    plots: Sequence[PlotRecipe] = (),
    sliders: tuple[str, ...] = (),
    chain: str = "",
    formulas: str = "",
    sources: tuple[str, ...] = (),
) -> Entry:
    """An Entry of a mechanism that a Builder makes: spatial loops, trains, parallel robots.

    build(p) -> Mechanism. path(p): joint or shaft -> first and last value; it is led along the path within `duration` [s] in the scene
    driven, by itself or by the given drives (the legs of a platform, whose coordinates the path has). timestep: of that scene [s];
    released: duration of the scene free-run [s], by default the same. closed(p, given): joints, shafts and points (n,) in closed form from
    those of the path (n,), where a closed form exists; rates that it does not give follow by differences.
    through(p): shares of the path, from 0 to 1, that are places too, beside PLACES even ones: where a number from outside is read off.
    """

    @lru_cache(maxsize=16)
    def made(p: Any, fidelity: str) -> Mechanism:
        return build(p)

    def by_hand(p: Any) -> ClosedMotion | None:
        return None if closed is None else ClosedMotion.along(path(p), partial(closed, p), short.places(p))

    short = _Short(name, made, "full", path, by_hand, duration, drives, through, released or duration, timestep)
    return Entry(
        name=name, title=title, summary=summary, parameters=parameters, build=made, fidelities={"full": "every part a body"},
        default_fidelity="full", scenes=short.scenes(), default_scene="driven", sliders=sliders, plots=tuple(plots),
        checks=(*short.checks(closed is not None), *short.outside_checks(outside)), chain=chain, formulas=formulas, sources=sources,
        family=family, origin=origin, use=use, outside=tuple(outside), path=path,
    )  # fmt: skip


def _at_speed(a: float, b: float, speed: float) -> PrescribedMotion:
    """An even turn; where the path is less than a turn, there and back, as fast as `speed` in the middle. At rest for a = b."""
    if a == b:
        return Ramp(a, 0.0)
    if abs(b - a) > 2.0 * np.pi - 1e-9:
        return Ramp(a, float(np.copysign(speed, b - a)))
    return Sine(0.5 * (b - a), abs(2.0 * speed / (b - a)), -0.5 * np.pi, 0.5 * (a + b))


def _in_time(a: float, b: float, duration: float) -> PrescribedMotion:
    """An even turn, or there and back, within a time [s]."""
    if a == b or abs(b - a) > 2.0 * np.pi - 1e-9:
        return Ramp(a, (b - a) / duration)
    return Sine(0.5 * (b - a), 2.0 * np.pi / duration, -0.5 * np.pi, 0.5 * (a + b))


def _closed_motion(kit: Planar, p: Any, path: Path) -> ClosedMotion:
    """The closed form of a planar linkage along the path, in the names of the engines."""
    chain, style = kit.linkage(p), kit.style(p)
    given = {n.removesuffix("_angle"): (np.linspace(a, b, PLACES), b - a, 0.0) for n, (a, b) in path.items()}
    motion = chain.solve(**given).require()
    values: dict[str, Any] = {}
    for link, turn in motion.turns.items():
        values |= {angle_name(link, style): np.unwrap(turn.x), f"{angle_name(link, style)}_rate": turn.v}
    for slide, s in motion.slides.items():
        values |= {f"{slide}_slide": s.x, f"{slide}_slide_rate": s.v}
    for point, z in motion.points.items():
        values |= {f"{point}_x": np.real(z.p), f"{point}_z": np.imag(z.p)}
        values |= {f"{point}_x_rate": np.real(z.v), f"{point}_z_rate": np.imag(z.v)}
    return ClosedMotion({n: np.broadcast_to(x, PLACES) for n, x in values.items()})


@dataclass(frozen=True)
class _Short:
    """What an entry in the short form makes of its path. motion(p): that of the closed form, or None."""

    name: str
    build: Callable[[Any, str], Mechanism]
    fidelity: str
    path: Callable[[Any], Path]
    motion: Callable[[Any], ClosedMotion | None]
    duration: float = 1.0
    drives: tuple[str, ...] = ()
    through: Callable[[Any], Sequence[float]] = lambda p: ()
    released: float = 1.0
    timestep: float = DRIVEN.timestep

    def places(self, p: Any) -> Array:
        """(n,) shares of the path: PLACES even ones, and those that it must pass through."""
        even = np.linspace(0.0, 1.0, PLACES)
        more = [x for x in self.through(p) if np.min(np.abs(even - x)) > 1e-12]
        return np.sort(np.append(even, more))

    def motions(self, p: Any) -> dict[str, Mapping[str, Array]]:
        """Witness -> its motion along the path."""
        return kept(self, p, self._motions)

    def _motions(self, p: Any) -> dict[str, Mapping[str, Array]]:
        closed, m = self.motion(p), self.build(p, self.fidelity)
        own: dict[str, Mapping[str, Array]] = {} if closed is None else {"analytic": closed}
        return own | {w: EngineMotion(w, m, self.path(p), self.places(p)) for w in WITNESSES}

    def _moves(self, p: Any) -> dict[str, PrescribedMotion]:
        """Joint or shaft -> its motion in the scene driven."""
        return {n: _in_time(a, b, self.duration) for n, (a, b) in self.path(p).items()}

    def scenes(self) -> dict[str, SceneRecipe]:
        """Scene driven: the drives go along the path by inverse dynamics; free-run: they are let go at its beginning."""

        def make(name: str) -> Callable[[Any, str], Scene]:
            def scene(p: Any, fidelity: str) -> Scene:
                t, moves = self.duration, self._moves(p)
                start, speed = ({n: float(m.at(0.0)[k]) for n, m in moves.items()} for k in (0, 1))
                law = ComputedTorque(self.drives or tuple(moves), tuple(moves.items()), (GAINS,) * len(moves))
                driven = replace(DRIVEN, timestep=self.timestep)
                laws, least, how, drives = ((law,), 1e-5, driven, "hold") if name == "driven" else ((), 1e-4, FREE, "free")
                tolerance = least * scale(self.build(p, fidelity))
                whole = t if laws else self.released
                return Scene(name, fidelity, whole, laws, start, speed, tolerance=tolerance, settings=how, drives=drives)

            return scene

        return {
            "driven": SceneRecipe(make("driven"), self.fidelity, "along the path, there and back or a turn, by inverse dynamics"),
            "free-run": SceneRecipe(make("free-run"), self.fidelity, "the drives are let go as the driven scene begins"),
        }

    def outside_checks(self, outside: Sequence[Outside]) -> tuple[Check, ...]:
        """A check for each number from outside: measured by every witness along the path."""

        def check(number: Outside) -> Callable[[Any], CheckResult]:
            def run(p: Any) -> CheckResult:
                values = {}
                for witness, motion in self.motions(p).items():
                    with suppress(NotInClosedForm):  # forces are asked of the engines alone
                        values[witness] = float(number.measured(p, motion))
                return CheckResult(values, number.tolerance, float(number.expected(p)), f"{number.text} [{number.unit}]")

            return run

        return tuple(Check(f"X{k}", o.text, check(o), o.source) for k, o in enumerate(outside, 1))

    def checks(self, closed: bool) -> tuple[Check, ...]:
        """Poses and rates along the path; a driven run; the closed form if any. Masses and forces are compared by the generic ones."""
        by_hand = Check("K3", "poses and rates along the path: the engines against the closed form", self._by_hand, "closed form")
        return (
            Check("K1", "it closes along its path: poses and rates of all frames and joints by every witness", self._poses, "each other"),
            Check("K2", "a driven run: MuJoCo against Pinocchio", self._run, "each other", slow=True),
            *((by_hand,) if closed else ()),
        )

    def _poses(self, p: Any) -> CheckResult:
        motions = self.motions(p)
        return self._compared({w: motions[w] for w in WITNESSES})

    def _by_hand(self, p: Any) -> CheckResult:
        return self._compared(self.motions(p))

    def _compared(self, motions: Mapping[str, Mapping[str, Array]]) -> CheckResult:
        names = [n for n in motions["mujoco"] if all(n in x for x in motions.values())]
        rows = {w: np.concatenate([x[n] for n in names]) for w, x in motions.items()}
        count = len(motions["mujoco"][names[0]])
        return CheckResult(rows, 1e-8, note=f"{count} places of the path, {len(names)} quantities")

    def _run(self, p: Any) -> CheckResult:
        m, made = self.build(p, self.fidelity), self.scenes()["driven"].make(p, self.fidelity)
        part = replace(made, duration=0.37 * made.duration)
        settings = {"mujoco": Settings(timestep=7e-4, timeconst=4.0), "pinocchio": self._exact(m, p)}
        ends = {n: engine(n).at_times(m, part, s, [part.duration]) for n, s in settings.items()}
        names = [n for n in m.scalar_names if all(n in r.channels for r in ends.values())]
        # as of driven_run: softness of MuJoCo's loops stays below 1e-6 here
        return CheckResult({n: [float(r.channels[x][-1]) for x in names] for n, r in ends.items()}, 1e-5, note=", ".join(names))

    def _exact(self, m: Mechanism, p: Any) -> Settings:
        """Settings with which Pinocchio's driven run is off by less than 1e-9."""
        if m.curves:  # step-size control does not see the knots that it steps across
            return Settings("pinocchio", timestep=1e-3)
        even = all(isinstance(x, Ramp) for x in self._moves(p).values())
        return Settings("pinocchio", integrator="DOP853", tolerance=EVEN if even else SWING)
