"""Engine `one_freedom`: any Mechanism of one freedom by its generalized inertia along the closed path (Eksergian).

    J = u^T M u,   J'/2 = u^T (M du + c(q, u)),   J phi'' + J'/2 phi'^2 = u^T (laws + weight + springs + dampers)

v = u phi'. No constraint rows and no drift: the loops are closed to rounding wherever the path was sampled, and to the
stated error between. Dry friction is smoothed below a small rate, as in the runner on Pinocchio.
"""

from __future__ import annotations

import math
import platform
import time

import numpy as np
import scipy
from numpy.typing import ArrayLike

from mechlab.clock import costed, spent_on
from mechlab.engines.own.closed_path import choose_path
from mechlab.engines.protocol import Engine
from mechlab.engines.state import RATE_LIMIT
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.experiment.energy import energy_finding
from mechlab.experiment.findings import (
    friction_finding,
    kinematic_findings,
    saturation_finding,
    sticks,
    stopped_finding,
)
from mechlab.experiment.laws import Law
from mechlab.experiment.laws.compiled import CompiledLaws
from mechlab.experiment.prices import CLOSED_POSE, ONE_FREEDOM, Price, price_of_laws
from mechlab.experiment.recording import Cost, Health, Recording, limit_finding, over_samples, run_channels
from mechlab.experiment.scene import Scene, Settings, initial_state, sample_grid
from mechlab.experiment.tree_plant import TreePlant
from mechlab.integrate import RK4, count_work, integrate_adaptive, integrate_fixed
from mechlab.integrate.one_freedom import PathTable, Terms, acceleration, right_side
from mechlab.mechanism import Joint, Mechanism, Shaft, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import unit_quaternions
from mechlab.mechanism.statics import passive_force
from mechlab.mechanism.structure import structure

INTEGRATORS = ("RK4", "DOP853")
PATH_ERROR = 1e-10
PATH_LIMIT = 1e-8
WIDTH = 2.0 * np.pi / 16.0
FRICTION_WIDTH = 0.1
"""Dry friction is smoothed below the rate timestep x max(this, acceleration by the friction alone) [rad/s2 or m/s2]."""


class OneFreedomPlant(TreePlant):
    """The mechanism at one state of its freedom: coordinates q (nq,), tangent u (nv,) = dq/dphi, rate w = phi', so v = w u.

    Values and rates are read without any kinematics.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        super().__init__(mechanism)
        self.move(0.0, self.q, self.v, 0.0)

    def move(self, t: float, q: Array, u: Array, w: float) -> None:
        """To time t [s], coordinates q, tangent u and rate w of the freedom."""
        self.t, self.q, self.u, self.w = t, q, u, w
        self._placed = False

    def rate(self, name: str) -> float:
        """Rate of a joint or shaft."""
        return self.w * float(self._row(name)[1] @ self.u)

    @property
    def tree(self) -> TreeKinematics:
        """The kinematics at the present state."""
        if not self._placed:
            self.v = self.w * self.u
        return super().tree


class OneFreedom:
    """A mechanism as one freedom through a closed pose q (default: the reference), and its equation under laws.

    `coordinate` is the joint or shaft that counts; `turn` what a full turn of it adds to q, or None.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        laws: tuple[Law, ...] = (),
        q: ArrayLike | None = None,
        tolerance: float = PATH_ERROR,
        timestep: float = 1e-3,
    ) -> None:
        self.mechanism, self.laws, self.applied = mechanism, laws, CompiledLaws(mechanism, laws)
        self.memory = self.applied.states
        self.path, self.turn = choose_path(mechanism, q)
        self.coordinate = self.path.coordinate
        self._price, self._pose = ONE_FREEDOM.of(mechanism) + price_of_laws(laws), CLOSED_POSE.of(mechanism)
        m = mechanism
        self.tree = TreeKinematics(m)
        self.plant = OneFreedomPlant(m)
        items: list[Joint | Shaft] = [*m.joints, *m.shafts]
        self._rough = [(x.friction, m.row(x.name)) for x in items if x.friction]
        self.rough_names = tuple(x.name for x in items if x.friction)
        shift = None
        if self.turn is not None:
            shift = np.concatenate([self.turn, np.zeros(2 * m.nv + 4)])
        self.table = PathTable(
            self.columns, WIDTH / max(1.0, float(np.max(np.abs(self.path.start.u)))), tolerance,
            period=None if shift is None else 2.0 * np.pi, turn=shift, origin=self.path.start.phi,
        )  # fmt: skip
        _, u, _, numbers = self.split(self.columns(self.path.start.phi))
        able = [
            size * float(row @ u) ** 2 / float(numbers[0]) if numbers[0] > 0.0 else 0.0 for size, row in self._rough
        ]
        self.width = timestep * np.maximum(FRICTION_WIDTH, able)
        self.evaluations = 0

    def columns(self, phi: float) -> Array:
        """(nq + 2 nv + 4,) exact q, u, du, J, J'/2, force of weight and springs, coefficient of damping at phi."""
        count_work(self._pose)
        point = self.path.at(phi)
        tree = self.tree.set(point.q)
        mass = tree.mass_matrix()
        still, elastic = tree.bias_force(), passive_force(tree)
        tree.set(point.q, point.u)
        quadratic = tree.bias_force() - still
        damped = passive_force(tree) - elastic
        u = point.u
        numbers = (u @ mass @ u, u @ (mass @ point.du + quadratic), u @ (elastic - still), u @ damped)
        return np.concatenate([point.q, u, point.du, numbers])

    def split(self, columns: Array) -> tuple[Array, Array, Array, Array]:
        """q, u, du and the four numbers of a row of the table."""
        nq, nv = self.mechanism.nq, self.mechanism.nv
        return columns[:nq], columns[nq : nq + nv], columns[nq + nv : nq + 2 * nv], columns[-4:]

    def standing(self, u: Array, w: float, a: Array, inertia: float) -> tuple[Array, Array]:
        """(k,) whether what has dry friction stands, and its rates, at tangent u, rate w and accelerations a (nv,)."""
        rows = np.array([row for _, row in self._rough]).reshape(-1, self.mechanism.nv)
        along, rates = rows @ u, w * (rows @ u)
        able = np.array([size for size, _ in self._rough]) * along**2 / inertia
        return sticks(rates[None], (rows @ a)[None], self.width, able)[0], rates

    def refuse_runaway(self, phi: float, w: float) -> None:
        """Raise NoSolution for a state that is not finite or too fast."""
        if not (abs(w) < RATE_LIMIT and math.isfinite(phi)):
            raise NoSolution(f"the rate of {self.coordinate} is {w:.3g}, beyond {RATE_LIMIT:g}; try a smaller timestep")

    def terms(self, t: float, y: Array) -> Terms:
        """The terms of the equation at y = (phi, phi', work, states of laws), and the forces of the laws in `forces`.

        Raises NoSolution where the motion is too fast for its path to be followed, MechlabError for a force that is not finite.
        """
        self.evaluations += 1
        count_work(self._price)
        phi, w = float(y[0]), float(y[1])
        self.refuse_runaway(phi, w)
        q, u, _, (inertia, half_slope, weight, damping) = self.split(self.table(phi))
        self.plant.move(t, q, u, w)
        self.memory.put(self.plant, y[3:])
        laws = self.applied
        laws.put(t, q, w * u)
        laws.put_states(y[3:])
        forces, applied = laws.forces(t, self.plant)
        self.forces = dict(zip(laws.targets, forces.tolist(), strict=True))
        for name, f in self.forces.items():
            if not math.isfinite(f):
                raise MechlabError(f"{self.mechanism.name}: the laws give {name!r} the force {f} at t = {t:.6g} s.")
        push = float(applied @ u) + float(damping) * w
        for (size, row), width in zip(self._rough, self.width, strict=True):
            along = float(row @ u)
            push -= size * along * float(np.tanh(along * w / width))
        return Terms(
            float(inertia), float(half_slope), push + float(weight), push * w, laws.state_rates(t, self.plant)
        )


@costed
def run(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings | None = None,
    times: ArrayLike | None = None,
) -> Recording:
    """A scene by the equation of the one freedom: RK4 with steps of at most `timestep`, or DOP853 with `tolerance`.

    Channels: the basic ones, NAME_accel of joints and shafts, NAME_force of whatever a law acts on. A path that ends in
    a limit position ends the run with the finding "blow_up". Raises MechlabError for a mechanism with more or less than
    one freedom.
    """
    settings = settings or Settings(engine="one_freedom")
    if settings.integrator not in INTEGRATORS:
        raise unknown("integrator of one_freedom", settings.integrator, INTEGRATORS)
    samples = sample_grid(scene.duration, settings.timestep, times)
    q0, v0 = initial_state(mechanism, scene)
    began = time.thread_time()
    model = OneFreedom(mechanism, scene.laws, q0, timestep=settings.timestep)
    first = [model.path.start.phi, float(mechanism.row(model.coordinate) @ v0), 0.0]
    state = np.concatenate([first, model.memory.initial])
    with spent_on("integrate"):
        t, y, steps, end = _integrate(model, settings, samples, state)
    spent = time.thread_time() - began
    with spent_on("record"):
        return _recording(model, scene, settings, t, y, Cost(spent, steps, model.evaluations), end)


def _integrate(
    model: OneFreedom, settings: Settings, times: Array, state: Array
) -> tuple[Array, Array, int, tuple[float, str] | None]:
    """States at the sample times, steps, and where and why it stopped early."""
    f = right_side(model.terms)
    seen, out, steps = [float(times[0])], [state], 0
    try:
        for t0, t1 in zip(times[:-1], times[1:], strict=True):
            if settings.integrator == "RK4":
                count = max(1, int(np.ceil((t1 - t0) / settings.timestep - 1e-9)))
                stop = integrate_fixed(RK4, f, t0, state, (t1 - t0) / count, count)
                steps += stop.steps
                if not stop.complete:
                    return np.array(seen), np.array(out), steps, (stop.t, stop.reason)
                state = stop.y
            else:
                found = integrate_adaptive(f, t0, state, t1, rtol=settings.tolerance, atol=1e-3 * settings.tolerance)
                steps += len(found.t) - 1
                if not found.complete:
                    return np.array(seen), np.array(out), steps, (float(found.t[-1]), found.outcome.value)
                state = found.y[-1]
            model.refuse_runaway(float(state[0]), float(state[1]))
            seen.append(float(t1))
            out.append(state)
    except NoSolution as cause:
        return np.array(seen), np.array(out), steps, (seen[-1], str(cause))
    return np.array(seen), np.array(out), steps, None


def _recording(
    model: OneFreedom,
    scene: Scene,
    settings: Settings,
    t: Array,
    y: Array,
    cost: Cost,
    end: tuple[float, str] | None,
) -> Recording:
    m = model.mechanism
    q, v, a = np.empty((len(t), m.nq)), np.empty((len(t), m.nv)), np.empty((len(t), m.nv))
    forces: list[dict[str, float]] = []
    power, rough = np.empty(len(t)), model.rough_names
    standing, rubbing = np.empty((len(t), len(rough)), dtype=bool), np.empty((len(t), len(rough)))
    for k in range(len(t)):
        w = float(y[k, 1])
        q[k], u, du, _ = model.split(model.table(float(y[k, 0])))
        terms = model.terms(float(t[k]), y[k])
        v[k], a[k] = u * w, u * acceleration(terms, w) + du * w**2
        power[k] = terms.power
        standing[k], rubbing[k] = model.standing(u, w, a[k], terms.inertia)
        forces.append(model.forces)
    q = unit_quaternions(m, q)
    acting = over_samples(forces)
    channels, units = run_channels(m, q, v, a, acting)
    with spent_on("check"):
        findings = [*kinematic_findings(m, q, v), energy_finding(m, t, q, v, power, y[:, 2], laws=scene.laws)]
    text = (
        f"along {model.coordinate}, {model.table.pieces} cells from {model.table.samples} closed poses; "
        "they are off between the nodes, relative to each column, by"
    )
    findings.append(limit_finding("path_error", model.table.error, PATH_LIMIT, "", text))
    limited = saturation_finding(scene.laws, acting)
    how = f"is smoothed below rates of {np.max(model.width, initial=0.0):.3g}"
    rubbed = friction_finding(rough, t, rubbing, standing, scene.tolerance, how)
    findings += [x for x in (limited, rubbed) if x is not None]
    if end is not None:
        findings.insert(0, stopped_finding(end[0], scene.duration, end[1]))
    return Recording(
        m, t, q, v, channels, units, Health(tuple(findings)), cost, settings, scene.name, m.name, scene.fidelity,
        versions={"numpy": np.__version__, "scipy": scipy.__version__, "python": platform.python_version()},
    )  # fmt: skip


class OneFreedomEngine(Engine):
    """See the module."""

    name = "one_freedom"
    fixed_steps = ("RK4",)
    run = staticmethod(run)

    def refuses(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, constraints: str = "", friction: str = ""
    ) -> str:
        """Refuses a mechanism that has not exactly one freedom."""
        freedoms = structure(mechanism).freedoms
        return "" if freedoms == 1 else f"it has {freedoms} freedoms"

    def price(self, mechanism: Mechanism, laws: tuple[Law, ...]) -> Price:
        """The price of the equation on its table."""
        return ONE_FREEDOM


ENGINES = {"one_freedom": OneFreedomEngine()}
