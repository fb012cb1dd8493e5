"""Random scenes with drives on random mechanisms: does the lab move as plain MuJoCo moves the file that it wrote?

    python -m tests.benchmarks.drives_agree [cases] [first seed]

A case draws a tree, or a mechanism with loops, gears and a shaft, one to four drives (position servos soft and stiff, with
and without a limit or a target of their own, dampers, plain motors, DC motors), a scene (`hold` or `free-motion`), loads on
joints and, for trees, initial values. The lab runs it; the file, read from disk, is stepped by mj_step with all controls at 0,
with the timestep, integrator and softness of the run, loads in qfrc_applied by the names of the joints, and for `free-motion`
without its actuators. Largest difference of any joint value, relative to how far the joints move: up to EXACT it agrees. The
current of a motor with inductance is integrated by the engine in first order and by the lab in fourth: there the difference
must fall with the timestep (at least 3 times, from h to h / 4), or be below SMALL. Prints counts and the worst cases.
"""

from __future__ import annotations

import itertools
import sys
import tempfile
import warnings
from collections import Counter
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import mujoco
import numpy as np

import mechlab as ml
from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Settings
from mechlab.lab.design import Design
from mechlab.lab.run import run_scene
from mechlab.mechanism import Builder, Joint, Mechanism, TreeKinematics
from mechlab.mechanism.parts import GROUND, Body, LinearRelation, Winding
from tests.engines.pinocchio.random_mechanisms import add_loop, direction, inertia, path_joints, placement

EXACT = 1e-8
"""The same steps by the same engine: rounding alone, grown by the motion."""
SMALL = 1e-4
DURATION = 0.25
KINDS = (
    "servo", "servo with target", "stiff servo", "limited servo", "damper", "limited damper", "motor", "dc motor",
    "dc motor with inductance",
)  # fmt: skip
INTEGRATORS = {
    "RK4": mujoco.mjtIntegrator.mjINT_RK4, "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A mechanism, and what is asked of it: scene, loads [N m or N] by joint, initial values by joint."""

    mechanism: Mechanism
    scene: str
    loads: dict[str, float]
    initial: dict[str, float]

    @property
    def text(self) -> str:
        """The case in a line."""
        m = self.mechanism
        drives = ", ".join(
            f"{d.on} {d.stiffness:.3g}/{d.damping:.3g}"
            + (f" limit {d.limit:.3g}" if d.limit else "")
            + (f" target {d.target:.3g}" if d.target is not None else "")
            + (f" winding L={d.winding.inductance:.2g}" if d.winding else "")
            for d in m.drives
        )
        return f"{m.name}, {len(m.loops)} loops, {self.scene}: {drives}; loads {len(self.loads)}, start {len(self.initial)}"


def drawn(seed: int) -> Case:
    """A case by its seed."""
    rng = np.random.default_rng([12, seed])
    b = Builder(f"driven_{seed}", gravity=tuple(rng.normal(size=3) * 5))
    names = [GROUND]
    for i in range(int(rng.integers(2, 6))):
        count = int(rng.choice([1, 1, 1, 2]))
        joints = tuple(
            Joint(
                f"joint_{i}_{k}", str(rng.choice(["revolute", "revolute", "prismatic"])), direction(rng),
                zero=float(rng.choice([0.0, rng.normal()])), damping=float(rng.choice([0.0, rng.uniform(0, 0.3)])),
                armature=float(rng.choice([0.0, rng.uniform(0, 0.1)])),
            )
            for k in range(count)
        )  # fmt: skip
        b.bodies.append(Body(f"body_{i}", str(rng.choice(names)), placement(rng), joints, inertia(rng)))
        names.append(f"body_{i}")
    scalar = [j.name for x in b.bodies for j in x.joints]
    looped = bool(rng.random() < 0.4) and len(names) > 3
    if looped:
        tree = TreeKinematics(b.build())
        one, two = rng.choice(names, 2, replace=False)
        add_loop(b, tree, rng, "loop", str(rng.choice(["spherical", "universal", "distance"])), str(one), str(two))
        if len(scalar) > 4:
            b.mesh(LinearRelation("gears", tuple((n, Fraction(int(rng.integers(1, 9)), 4)) for n in scalar[:2])))
    if leaf := path_joints(b):
        b.shaft("shaft", {n: Fraction(int(rng.integers(1, 9)), 4) for n in leaf}, inertia=0.2, damping=0.1)
    for on in rng.permutation([*scalar, *(["shaft"] if leaf else [])])[: int(rng.integers(1, 5))]:
        add_drive(b, rng, str(on))
    m = b.build()
    if np.linalg.eigvalsh(TreeKinematics(m).mass_matrix())[0] < 1e-4:
        raise MechlabError("two joints of a body move it alike: its mass matrix is singular, it is no mechanism")
    scene = "free-motion" if rng.random() < 0.2 or not holding(m) else "hold"
    loaded = [n for n in scalar if rng.random() < 0.3]
    moved = [] if looped else [n for n in scalar if rng.random() < 0.3]
    return Case(
        m,
        scene,
        {n: float(rng.normal() * 5) for n in loaded},
        {n: m.zero(n) + float(rng.normal() * 0.2) for n in moved},
    )


def add_drive(b: Builder, rng: np.random.Generator, on: str) -> None:
    """A drive of a random kind."""
    kind = str(rng.choice(KINDS))
    k, c = 10.0 ** rng.uniform(0.5, 3.0), 10.0 ** rng.uniform(-1.5, 1.0)
    if kind == "stiff servo":
        b.drive(on, 1e3 * k, 10.0 * c * float(rng.choice([0.0, 1.0, 1.0])))
    elif "servo" in kind:
        limit = float(10.0 ** rng.uniform(0, 1.5)) if kind.startswith("limited") else None
        b.drive(on, k, c, limit, target=float(rng.normal() * 0.3) if kind.endswith("target") else None)
    elif kind.startswith("dc"):
        resistance = float(10.0 ** rng.uniform(-1, 1))
        lag = 10.0 ** rng.uniform(-2.0, -1.0) if "inductance" in kind else 0.0
        b.drive(on, winding=Winding(float(10.0 ** rng.uniform(-2, 0)), resistance, lag * resistance))
    else:
        limit = float(10.0 ** rng.uniform(-0.5, 1.0)) if kind.startswith("limited") else None
        b.drive(on, damping=c if kind.endswith("damper") else 0.0, limit=limit)


def holding(m: Mechanism) -> bool:
    """Whether the mechanism has the scene `hold`: a drive that gives a force by itself."""
    return any(d.stiffness or d.damping or d.winding for d in m.drives)


def by_lab(case: Case, timestep: float | None = None) -> Recording:
    """The run of the lab, without the estimate of its step error."""
    extra = {f"{n}_force": f for n, f in case.loads.items()} | {f"{n}_0": x for n, x in case.initial.items()}
    return run_scene(
        ml.load(case.mechanism), case.scene, duration=DURATION, timestep=timestep, extra=extra, estimate=False
    )


def by_file(folder: Path, case: Case, settings: Settings) -> np.ndarray:
    """(joints of one coordinate,) coordinates at the end, of the file on disk."""
    m = case.mechanism
    model = mujoco.MjModel.from_xml_path(str(folder / f"{m.name}.xml"))
    model.opt.timestep, model.opt.integrator = settings.timestep, INTEGRATORS[settings.integrator]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    if settings.solref is not None:
        model.eq_solref[:] = settings.solref
    if case.scene == "free-motion":
        model.opt.disableactuator, model.actuator_damping[:] = 1, 0.0  # group 0: all of the file
    data = mujoco.MjData(model)
    for name, value in case.initial.items():
        data.qpos[model.joint(name).qposadr[0]] = value - m.zero(name)
    for name, force in case.loads.items():
        data.qfrc_applied[model.joint(name).dofadr[0]] = force
    count = int(np.ceil(DURATION / settings.timestep - 1e-9))
    mujoco.mj_step(model, data, nstep=count - 1)
    model.opt.timestep = DURATION - (count - 1) * settings.timestep  # the last step of a run may be shorter
    mujoco.mj_step(model, data)
    return np.array([data.qpos[model.joint(j.name).qposadr[0]] for j in m.joints if j.nv == 1])


def save(design: Design, folder: str | Path, fidelity: str | None = None) -> None:
    """The files of a design; a warning that they say another timestep is none here: they run at that of the lab."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "[^:]*: the file says", UserWarning)
        design.save(folder, fidelity)


def difference(case: Case, timestep: float | None = None) -> tuple[float, Recording]:
    """Largest difference of a joint, relative to the largest motion of one (at least .01 rad or m); and the run."""
    run = by_lab(case, timestep)
    if run.t[-1] < DURATION * (1 - 1e-9):
        return float("nan"), run
    with tempfile.TemporaryDirectory() as folder:
        save(ml.load(case.mechanism), folder)
        at = by_file(Path(folder), case, run.settings)
    joints = [j for j in case.mechanism.joints if j.nv == 1]
    ours = np.array([run.channel(j.name)[-1] - j.zero for j in joints])
    moved = max(0.01, *(float(np.ptp(run.channel(j.name))) for j in joints))
    return float(np.max(np.abs(at - ours))) / moved, run


def compare(seed: int) -> tuple[str, float, str]:
    """What became of a case, its difference, and the line that says so."""
    try:
        case = drawn(seed)
    except MechlabError as why:
        return "no mechanism", 0.0, str(why)
    try:
        gap, run = difference(case)
    except MechlabError as why:
        return "refused", 0.0, f"{case.text}: {why}"
    except Exception as fault:  # a fault of the lab is a result of the campaign, not its end
        return "WRONG", 0.0, f"{case.text}: raised {fault!r}"
    line = f"{gap:.2e} {case.text} ({run.settings.integrator}, {run.settings.timestep:g} s)"
    if np.isnan(gap):
        return ("blew up" if not run.health.trusted else "WRONG"), 0.0, line
    if gap <= EXACT:
        return "agrees", gap, line
    if case.scene == "hold" and any(d.winding is not None and d.winding.inductance for d in case.mechanism.drives):
        finer = difference(case, 0.25 * run.settings.timestep)[0]
        if finer <= SMALL or finer * 3.0 <= gap:
            return "agrees in first order", gap, f"{line}; at a quarter of the step {finer:.2e}"
    return "WRONG", gap, line


def main(cases: int = 200, first: int = 0) -> None:
    """Run the cases, seeds that draw no mechanism passed over, print counts and the worst."""
    counts: Counter[str] = Counter()
    found: list[tuple[float, str, int, str]] = []
    for seed in itertools.count(first):
        if len(found) == cases:
            break
        verdict, gap, line = compare(seed)
        if verdict == "no mechanism":
            continue
        counts[verdict] += 1
        found.append((gap, verdict, seed, line))
        if verdict in ("WRONG", "refused", "blew up"):
            print(f"{verdict}: seed {seed}: {line}", flush=True)
    print(", ".join(f"{n} {verdict}" for verdict, n in counts.most_common()))
    for _, verdict, seed, line in sorted(found, key=lambda x: -x[0])[:5]:
        print(f"worst: seed {seed}: {verdict}: {line}")


if __name__ == "__main__":
    main(*(int(x) for x in sys.argv[1:]))
