"""The map of stiffness: springs, dampers and servos of a scene limit the timestep, and theory says how much.

Near a pose, for motions that the constraints allow, M a + C v + K q = 0. One step of size h is a matrix. The method is
stable while the spectral radius of this matrix does not exceed the growth exp(h Re lambda) of the motion itself. For
one undamped mode omega: h = 2 / omega (semi-implicit Euler), 2.828 / omega (RK4); for one decay with time constant tau:
2.785 tau (RK4). Hairer & Wanner, Solving ODEs II, IV.2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mechlab.experiment.acting import held_drives
from mechlab.experiment.laws import DcMotor, Law, Motor, OneSidedStop, Servo, Viscous
from mechlab.experiment.scene import Scene, initial_state
from mechlab.lab.methods import Method, Problem
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import integrate
from mechlab.mechanism.statics import passive_force
from mechlab.mechanism.structure import null_space
from mechlab.studies.stability.data import StabilityAxis, Theory
from mechlab.studies.stability.plan import DIVISIONS, OUTPUTS, StabilityCase, StabilityPlan, steps_of, tree_methods
from mechlab.studies.stability.vary import scale_servos, scale_springs

GROWTH = 1e-3
STIRRED = 1e-6


@dataclass(frozen=True)
class LinearisedScene:
    """Mass, stiffness and damping matrices (n, n) of the model and of the laws, on the n motions that the constraints
    allow.

    `joint_damping`: the part of the model's damping in joints; `held_stiffness`, `held_damping`: the part of the laws
    that MuJoCo's own actuators apply (drives that hold).
    """

    mass: Array
    stiffness: Array
    damping: Array
    joint_damping: Array
    law_stiffness: Array
    law_damping: Array
    held_stiffness: Array
    held_damping: Array

    def matrix(self) -> Array:
        """System matrix A (2n, 2n) of d(q, v)/dt = A (q, v)."""
        n = len(self.mass)
        k, c = self.stiffness + self.law_stiffness, self.damping + self.law_damping
        lower = -np.linalg.solve(self.mass, np.hstack([k, c]))
        return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower])

    @property
    def fastest(self) -> complex:
        """The eigenvalue of largest absolute value [1/s], with imaginary part >= 0."""
        values = np.linalg.eigvals(self.matrix())
        k = int(np.argmax(np.abs(values)))
        return complex(values[k].real, abs(values[k].imag))


def linearise(mechanism: Mechanism, scene: Scene) -> LinearisedScene:
    """Springs, dampers and servos of a scene, linearized about its initial pose. Gravity and velocity terms are left
    out: they do not limit the timestep. Raises as `initial_state`."""
    q, v = initial_state(mechanism, scene)
    tree = TreeKinematics(mechanism, q, v)
    basis = (
        null_space(ConstraintSet(mechanism).jacobian(tree)) if ConstraintSet(mechanism).rows else np.eye(mechanism.nv)
    )
    mass = tree.mass_matrix()
    still = np.zeros(mechanism.nv)

    def force(x: Array, rate: Array) -> Array:
        return passive_force(TreeKinematics(mechanism, x, rate))

    columns_k, columns_c = [], []
    for e in basis.T:
        ahead, back = integrate(mechanism, q, STIRRED * e), integrate(mechanism, q, -STIRRED * e)
        columns_k.append(-(force(ahead, still) - force(back, still)) / (2.0 * STIRRED))
        columns_c.append(-(force(q, e) - force(q, still)))
    joint = np.diag([j.damping for j in mechanism.joints for _ in range(j.nv)])
    law_k, law_c = _laws(mechanism, scene.laws)
    held_k, held_c = _laws(mechanism, held_drives(scene.laws))

    def onto(matrix: Array) -> Array:
        return np.asarray(basis.T @ matrix @ basis)

    return LinearisedScene(
        onto(mass), basis.T @ np.column_stack(columns_k), basis.T @ np.column_stack(columns_c), onto(joint),
        onto(law_k), onto(law_c), onto(held_k), onto(held_c),
    )  # fmt: skip


def _laws(mechanism: Mechanism, laws: Sequence[Law]) -> tuple[Array, Array]:
    """(nv, nv) stiffness and damping of the laws that depend on the state."""
    k, c = np.zeros((mechanism.nv, mechanism.nv)), np.zeros((mechanism.nv, mechanism.nv))
    for law in laws:
        if isinstance(law, Servo):
            outer = np.outer(mechanism.row(law.on), mechanism.row(law.on))
            k, c = k + law.stiffness * outer, c + law.damping * outer
        elif isinstance(law, Viscous | Motor | DcMotor | OneSidedStop):
            row = mechanism.row(law.on)
            if isinstance(law, Viscous):
                c = c + law.coefficient * np.outer(row, row)
            elif isinstance(law, Motor):
                c = c + law.stall / law.no_load_rate * np.outer(row, row)
            elif isinstance(law, DcMotor) and not law.inductance:
                c = c + law.constant**2 / law.resistance * np.outer(row, row)
    return k, c


StepMap = Callable[[float], Array]


def step_map(linear: LinearisedScene, method: Method) -> StepMap | None:
    """A function that gives the matrix (2n, 2n) of one step h [s]; None for a method with error control.

    MuJoCo treats implicitly: with Euler the damping of joints; with implicit and implicitfast all damping of the model;
    with discrete all damping and springs of the model. Drives that hold are actuators of the model. Other laws are
    explicit.
    """
    n = len(linear.mass)
    k, c = linear.stiffness + linear.law_stiffness, linear.damping + linear.law_damping
    if method.integrator == "RK4":
        a = linear.matrix()

        def rk4(h: float) -> Array:
            z = h * a
            return np.asarray(
                np.eye(2 * n) + z @ (np.eye(2 * n) + z @ (np.eye(2 * n) + z @ (np.eye(2 * n) + z / 4.0) / 3.0) / 2.0)
            )

        return rk4
    none = np.zeros((n, n))
    implicit_c = {
        "Euler": linear.joint_damping,
        "implicit": linear.damping + linear.held_damping,
        "implicitfast": linear.damping + linear.held_damping,
        "discrete": linear.damping + linear.held_damping,
    }
    if method.integrator not in (*implicit_c, "semi_implicit_Euler"):
        return None
    ci = implicit_c.get(method.integrator, none)
    ki = linear.stiffness + linear.held_stiffness if method.integrator == "discrete" else none

    def semi(h: float) -> Array:
        left = linear.mass + h * ci + h * h * ki
        gain = np.linalg.solve(left, np.hstack([-h * k, -h * (c + h * ki)]))
        lower = np.hstack([np.zeros((n, n)), np.eye(n)]) + gain
        return np.vstack([np.hstack([np.eye(n), np.zeros((n, n))]) + h * lower, lower])

    return semi


def largest_step(linear: LinearisedScene, method: Method) -> float:
    """The largest stable timestep [s] of a method on a linear system; infinite where every step tried is stable, where
    nothing is stiff, or for a method with error control."""
    step = step_map(linear, method)
    fastest = abs(linear.fastest)
    if step is None or fastest < 1e-9:
        return float("inf")
    growth = max(0.0, float(np.max(np.linalg.eigvals(linear.matrix()).real)))

    def stable(h: float) -> bool:
        radius = float(np.max(np.abs(np.linalg.eigvals(step(h)))))
        return radius <= (1.0 + GROWTH * min(1.0, h * fastest)) * float(np.exp(min(h * growth, 50.0)))

    tried = np.geomspace(0.05, 1e3, 120) / fastest
    for low, high in zip(tried[:-1], tried[1:], strict=True):
        if not stable(high):
            for _ in range(40):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if stable(middle) else (low, middle)
            return float(low)
    return float("inf")


def formula(linear: LinearisedScene, method: Method) -> str:
    """The boundary as text: the formula of the textbook case where the fastest mode is undamped or a pure decay."""
    mode = linear.fastest
    undamped, decay = abs(mode.imag) > 20.0 * abs(mode.real), abs(mode.real) > 20.0 * abs(mode.imag)
    if method.integrator == "RK4":
        return "h = 2.83/ω" if undamped else "h = 2.79 τ" if decay else "RK4: |R(h λ)| = 1"
    return "h = 2/ω" if undamped else "h²ω² + 2hc = 4"


FACTORS = (1e-2, 10**-1.5, 1e-1, 10**-0.5, 1.0, 10**0.5, 1e1, 10**1.5, 1e2)
FEW = (DIVISIONS[:7], FACTORS[::2])
"""Coarser grid for scenes with servos: their laws are evaluated in Python at every stage of every step."""


def stiff_parts(mechanism: Mechanism) -> dict[str, tuple[float, str]]:
    """Name -> stiffness and its unit of every spring, sprung joint and sprung shaft."""
    out = {s.name: (s.stiffness, "N/m") for s in mechanism.springs if s.stiffness}
    for j in mechanism.joints:
        if j.stiffness:
            out[j.name] = (j.stiffness, "N/m" if j.kind == "prismatic" else "N m/rad")
    return out | {s.name: (s.stiffness, "N m/rad") for s in mechanism.shafts if s.stiffness}


def plan_stiffness(case: StabilityCase) -> StabilityPlan | str:
    """The map of stiffness, or a text that says why there is none."""
    m, scene = case.mechanism, case.scene
    springs = stiff_parts(m)
    servos = {w.on: w.stiffness for w in scene.laws if isinstance(w, Servo | OneSidedStop) and w.stiffness}
    if not springs and not servos:
        return "it has no springs, and the scene no servo: nothing that limits the timestep by its stiffness"
    methods = tree_methods(case)

    def problem(y: float) -> Problem:
        return case.problem(scale_springs(m, y), scale_servos(scene, y), duration)

    limits = [x for x in (largest_step(linearise(m, scene), w) for w in methods) if x < 1e3]
    if not limits:
        return "no explicit method among those asked for: springs do not limit their timestep"
    divisions, factors = FEW if servos else (DIVISIONS, FACTORS)
    top = min(max(limits), 4.0 * min(limits))  # what is treated implicitly may have a limit far away
    duration = OUTPUTS * (min(divisions) * max(divisions) * min(limits) * top) ** 0.5

    def theory(shown: tuple[Method, ...]) -> tuple[Theory, ...]:
        return spring_theory(factors, [_linear(problem(y)) for y in factors], shown)

    named = [f"{n} {k:.3g} {u}" for n, (k, u) in springs.items()] + [f"servo of {n} {k:.3g}" for n, k in servos.items()]
    text = f"stiffness of {', '.join(named[:3])}{', ...' if len(named) > 3 else ''}, times this; damping by its root"
    return StabilityPlan(
        "stiffness", "timestep and stiffness", StabilityAxis("stiffness / as given", "", factors, text, 1.0), problem, methods,
        steps_of(duration, divisions), theory=theory,
        remark="the limits of theory are those of the start pose" if m.loops else "",
    )  # fmt: skip


def _linear(problem: Problem) -> LinearisedScene:
    return linearise(problem.mechanism, problem.scene)


def spring_theory(
    values: tuple[float, ...], systems: list[LinearisedScene], methods: tuple[Method, ...]
) -> tuple[Theory, ...]:
    """The largest stable step of every method at every value; methods with the same limits share one line."""
    lines: dict[tuple[tuple[float, ...], str], list[str]] = {}
    for m in methods:
        limits = tuple(largest_step(s, m) for s in systems)
        if all(x < float("inf") for x in limits):
            rounded = tuple(float(f"{x:.9g}") for x in limits)
            lines.setdefault((rounded, formula(systems[len(systems) // 2], m)), []).append(m.name)
    return tuple(
        Theory("largest stable timestep", text, limits, values, tuple(names)) for (limits, text), names in lines.items()
    )
