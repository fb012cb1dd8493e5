"""Makes the question, scenes, reference Recording and checks of an entry with one drive from its closed form.

The entry declares `pose(p, angle, rate, accel)`: the motion of all joints and shafts for this motion of the drive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.experiment.entry import Check, CheckResult, SceneRecipe
from mechlab.experiment.laws import Constant, Law, Servo
from mechlab.experiment.motion import Ramp
from mechlab.experiment.question import Answer, Question, with_rates
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.checks import EXACT, by_witnesses, end_of_run, moving_check
from mechlab.kit.mass_check import State
from mechlab.kit.own_equations import one_freedom_slope, record_own
from mechlab.kit.questions import RATES, both_spellings, by_engines, not_assembled, with_orders
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, Status
from mechlab.mechanism.geometry import Array

Range = tuple[float, float]


@dataclass(frozen=True)
class CrankPose:
    """The motion of a mechanism of one drive, for numbers or arrays.

    values: joint or shaft -> value, rate, acceleration. more: further answers, without rates. assembles: True where the
    loops close; gap [m]: distance by which they do not; regular: True where rates exist.
    """

    values: Mapping[str, tuple[Any, Any, Any]]
    more: Mapping[str, Any] = field(default_factory=dict)
    assembles: ArrayLike = True
    gap: ArrayLike = 0.0
    regular: ArrayLike = True


@dataclass(frozen=True)
class Crank:
    """An entry with one drive. build: that of the entry. pose(p, angle, rate, accel): the closed form. answers: joints
    and shafts that the question answers. own(p): (angle, rate, torque) -> acceleration of the drive, the equation of
    motion. ends(p, pose): point -> position [m] and velocity [m/s] as x + i y; bars(p): (point, point, mass [kg],
    radius [m]) of each bar. start(p): drive angle of the reference pose [rad]. ranges(p): intervals of the drive [rad]
    in which it assembles; checks use the first. drive: name of the drive joint, NAME_angle."""

    build: Callable[[Any, str], Mechanism]
    pose: Callable[..., CrankPose]
    answers: tuple[str, ...]
    own: Callable[[Any], Callable[[float, float, float], float]]
    ends: Callable[[Any, CrankPose], Mapping[str, tuple[complex, complex]]]
    bars: Callable[[Any], Sequence[tuple[str, str, float, float]]]
    start: Callable[[Any], float]
    ranges: Callable[[Any], Sequence[Range]]
    drive: str = "crank_angle"

    # -- the question --------------------------------------------------------------------------------------------------

    def question(self, text: str, more: Sequence[str] = ()) -> Question:
        """Angles, rates and accelerations of the answers from those of the drive, by three witnesses. more: keys of
        `CrankPose.more`, angles that the closed form alone answers."""
        short = self.drive.removesuffix("_angle")
        optional = {f"{short}_rate": 0.0, f"{short}_accel": 0.0}
        given = {self.drive: self.drive} | {k: k.replace(short, self.drive) for k in optional}
        answers = both_spellings(with_orders({n: n for n in self.answers}))
        engines = by_engines(self.build, given, answers)

        def analytic(p: Any, values: Mapping[str, Any]) -> Answer:
            found = self.pose(p, *(values[k] for k in given))
            if not np.all(found.assembles):
                return not_assembled("the bars are", found.gap, found.assembles)
            orders = {f"{n}{s}": found.values[n][k] for n in self.answers for k, s in enumerate(RATES)}
            status = Status.SOLVED if np.all(found.regular) else Status.BOUNDARY
            return Answer(both_spellings(orders | dict(found.more)), status)

        asked = [n for order in RATES for n in (f"{a}{order}" for a in self.answers)]
        return Question(
            "pose", given=(self.drive,), optional=dict(optional), answers=tuple(n.replace("_angle_", "_") for n in asked),
            witnesses={"analytic": analytic} | engines, angles=self.answers,
            units=both_spellings(with_rates(dict.fromkeys((self.drive, *self.answers, *more), "rad"))), text=text,
        )  # fmt: skip

    # -- scenes --------------------------------------------------------------------------------------------------------

    def scenes(self, speed: str, torque: str, stiffness: float, damping: float) -> dict[str, SceneRecipe]:
        """Three scenes: the crank driven by a servo for 2 s, released at speed, and started by a constant torque, for 1 s.

        speed, torque: names of the parameters for the rate [rad/s] and the torque [N m]; stiffness [N m/rad] and
        damping [N m s/rad] of the servo.
        """
        on = self.drive

        def recipe(name: str, text: str, laws: Callable[[Any], tuple[Law, ...]]) -> SceneRecipe:
            def make(p: Any, fidelity: str) -> Scene:
                rate = 0.0 if name == "constant-torque" else getattr(p, speed)
                # under a constant torque the crank gets fast: 100 rad/s after 1 s
                time, settings = (1.0, Settings(timestep=2.5e-4)) if name == "constant-torque" else (2.0, Settings())
                drives = "hold" if laws(p) else "free"
                return Scene(name, fidelity, time, laws(p), {on: self.start(p)}, {on: rate}, tolerance=1e-4, settings=settings,
                             drives=drives)  # fmt: skip

            return SceneRecipe(make, "minimal", text)

        return {
            "driven-crank": recipe(
                "driven-crank", "a servo turns the crank at constant speed",
                lambda p: (Servo(on, Ramp(self.start(p), getattr(p, speed)), stiffness=stiffness, damping=damping),),
            ),
            "free-run": recipe("free-run", "the crank is let go at full speed", lambda p: ()),
            "constant-torque": recipe(
                "constant-torque", "a constant torque starts the crank from rest", lambda p: (Constant(on, getattr(p, torque)),)
            ),
        }  # fmt: skip

    # -- the own equation ----------------------------------------------------------------------------------------------

    def reference(self, p: Any, scene: Scene, method: str = "DOP853", tolerance: float = 1e-12) -> Recording:
        """The Recording of the own equation of motion, integrated to a relative tolerance; the closed form gives the
        other joints."""
        m = self.build(p, "minimal")

        def states(y: Array) -> tuple[Array, Array]:
            found = self.pose(p, *y.T, 0.0).values
            q = np.column_stack([np.unwrap(found[j.name][0]) - j.zero for j in m.joints])
            q -= 2 * np.pi * np.round(q[0] / (2 * np.pi))
            return q, np.column_stack([found[j.name][1] for j in m.joints])

        slope = one_freedom_slope(m, scene, self.drive, self.own(p))
        start = np.array([scene.initial[self.drive], scene.initial_rates[self.drive]])
        return record_own(m, scene, slope, start, states, method, tolerance)

    # -- checks --------------------------------------------------------------------------------------------------------

    def pose_check(self, id: str, question: Question, source: str) -> Check:
        """Seven positions of the drive across its range, from every witness of the question."""

        def run(p: Any) -> CheckResult:
            if not (ranges := self.ranges(p)):
                return CheckResult({}, 0.0, note="no assembly exists with these lengths")
            rates = dict.fromkeys(question.optional, 1.3) | {k: -0.7 for k in question.optional if k.endswith("_accel")}
            given = [{self.drive: float(x)} | rates for x in np.linspace(*ranges[0], 9)[1:-1]]
            note = "7 positions of the drive: angles (as cosine and sine), rates, accelerations"
            return by_witnesses(p, question, given, 1e-8, note)

        return Check(id, "position, rate and acceleration from three witnesses", run, source)

    def run_check(
        self, id: str, scene: Callable[[Any, str], Scene], speed: Callable[[Any], float], source: str
    ) -> Check:
        """The rate of the drive at the end of a scene without laws: MuJoCo and Pinocchio against the own equation."""

        def run(p: Any) -> CheckResult:
            made = scene(p, "minimal")
            # MuJoCo's loop is soft to second order in the step: 1e-5 relative at 0.7 ms, in a motion of a few turns.
            return end_of_run(
                self.build(p, "minimal"), made, self.reference(p, made), (Settings(timestep=7e-4), EXACT),
                1e-4 * max(1.0, abs(speed(p))), f"{self.drive}_rate",
                f"{self.drive.removesuffix('_angle')} speed after a free run of {made.duration:g} s",
            )  # fmt: skip

        return Check(id, "free run against the equation of the one freedom", run, source)

    def mass_check(self, id: str) -> Check:
        """The check of masses and momenta at two moving states, the first at the reference pose."""

        def states(p: Any) -> list[State]:
            start, ranges = self.start(p), self.ranges(p)
            step = 0.3 * min(1.0, ranges[0][1] - start) if ranges else 0.3
            found = [self.pose(p, x, rate, 0.0) for x, rate in ((start, 1.3), (start + step, -0.7))]
            from mechlab.kit.planar_mass import bars_state  # and the linkages of Assur groups

            return [bars_state(f.values, self.ends(p, f), self.bars(p), p.gravity) for f in found]

        return moving_check(id, self.build, "minimal", states, from_reference=True)
