"""A04: Bricard's mechanism, five bars and six hinges: one freedom where counting finds none."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mechlab.analytic.benchmarks.spatial import AXES, CORNERS, Bricard
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.integrate import integrate_adaptive
from mechlab.kit import benchmark_parts as parts
from mechlab.kit import mass_check, palette
from mechlab.kit.checks import moving_check
from mechlab.kit.own_equations import record_own
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import Array, frame_along
from mechlab.mechanism.inertia import Inertia

SOURCE = "IFToMM benchmark library, A04"


@dataclass(frozen=True)
class Parameters:
    """Square bars on the edges of a cube, hinges along edges that cross them."""

    length: float = parameter(1.0, "m", "edge of the cube: all bars", source=SOURCE, low=0, strict=True)
    masses: tuple[float, float, float, float, float] = parameter(
        (1.0, 1.0, 1.0, 1.0, 1.0), "kg", "masses of the bars P0-P1 to P4-P5", source=SOURCE, low=0, strict=True
    )
    section: float = parameter(
        0.1, "m", "width of the bars: their inertia is that of a brick", source=SOURCE, low=0, strict=True
    )
    gravity_vector: tuple[float, float, float] = parameter((0.0, -9.81, 0.0), "m/s2", "gravity", source=SOURCE)
    duration: float = parameter(10.0, "s", "duration of the scene", source=SOURCE, low=0, strict=True, scene=True)


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """A chain of five bars; the sixth hinge closes it to the ground (5 rows, one of them redundant)."""
    b = Builder("bricard", gravity=p.gravity_vector, summary="Bricard's mechanism, benchmark A04")
    colors = (palette.BLUE, palette.ORANGE, palette.TEAL, palette.ROSE, palette.GOLD)
    w = 0.06 * p.length
    for k, mass in enumerate(p.masses):
        along = CORNERS[k + 1] - CORNERS[k]
        middle = 0.5 * p.length * along
        x, y, z = p.section + (p.length - p.section) * np.abs(along)
        bar = Inertia.box(mass, float(x), float(y), float(z), tuple(middle.tolist()))
        sides = 0.9 * w + (p.length - 1.9 * w) * np.abs(along)
        turn = frame_along(tuple(AXES[k].tolist()))
        looks = [
            shape(
                "box",
                Placement(tuple(middle.tolist())),
                colors[k],
                f"bar_{k}",
                **dict(zip("xyz", sides.tolist(), strict=True)),
            ),
            shape(
                "cylinder",
                Placement.of(turn, (0.0, 0.0, 0.0)),
                palette.SLATE,
                f"pin_{k}",
                radius=0.4 * w,
                length=2.2 * w,
            ),
        ]
        at = p.length * (CORNERS[k] - (CORNERS[k - 1] if k else 0.0))
        b.body(
            f"bar_{k}",
            revolute(f"hinge_{k}", AXES[k].tolist()),
            parent=f"bar_{k - 1}" if k else "ground",
            at=at.tolist(),
            inertia=bar,
            shapes=looks,
        )
        b.frame(f"P{k + 1}", f"bar_{k}", (p.length * along).tolist())
    last = (p.length * (CORNERS[5] - CORNERS[4])).tolist()
    b.loop("hinge_5", "bar_4", "ground", last, (p.length * CORNERS[5]).tolist(), "revolute", AXES[5].tolist())
    pin = Placement.of(frame_along(tuple(AXES[5].tolist())), tuple((p.length * CORNERS[5]).tolist()))
    b.ground(shape("cylinder", pin, palette.SLATE, "pin_5", radius=0.4 * w, length=2.2 * w))
    return b.build()


CHANNELS = parts.tracked("P2", "xyz")


def _fall(p: Parameters, fidelity: str) -> Scene:
    return Scene("fall", fidelity, p.duration, channels=tuple(CHANNELS), tolerance=1e-3)


def reference(p: Parameters, scene: Scene, method: str = "DOP853", tolerance: float = 1e-13) -> Recording:
    """Screws in world axes and the null vector of the loop: no tree, no constraint forces."""
    own = Bricard(p.length, p.masses, p.section, p.gravity_vector)

    def states(y: Array) -> tuple[Array, Array]:
        return y[:, :5], y[:, 6:11]

    return record_own(build(p, "full"), scene, own.slope, np.zeros(12), states, method, tolerance)


def moving(p: Parameters, time: float) -> mass_check.State:
    """The scene at a time, by screws, in particles."""
    own = Bricard(p.length, p.masses, p.section, p.gravity_vector)
    start = np.zeros(12)
    y = integrate_adaptive(own.slope, 0.0, start, time, method="DOP853", rtol=1e-12, atol=1e-13, times=()).y[-1]
    q, v = y[:6], y[6:]
    spread = np.full(3, p.section)
    particles, points, turn, drift = mass_check.NOTHING, {}, np.zeros(3), np.zeros(3)
    poses = own.poses(q)
    for k, (screw, mass) in enumerate(zip(own.screws(poses), p.masses, strict=False)):
        drift, turn = drift + v[k] * screw[:3], turn + v[k] * screw[3:]
        rotation, shift = poses[0][k], poses[1][k]
        middle = rotation @ (0.5 * p.length * (CORNERS[k] + CORNERS[k + 1])) + shift
        edges = spread + (p.length - p.section) * np.abs(CORNERS[k + 1] - CORNERS[k])
        particles += mass_check.solid(
            mass, middle, edges / np.sqrt(12.0), rotation, drift + np.cross(turn, middle), turn
        )
        points[f"P{k + 1}"] = rotation @ (p.length * CORNERS[k + 1]) + shift
    values, rates = ({f"hinge_{k}": float(x) for k, x in enumerate(z[:5])} for z in (q, v))
    return mass_check.State(values, rates, particles, points, p.gravity_vector, 1)


PRINTED = {
    1.0: (0.274481319265, -0.886707938735, -0.462330002687),
    5.0: (0.999932742302, -0.999999997738, -6.72554361e-5),
    10.0: (0.999730987304, -0.999999963826, -2.68976513e-4),
}

PROBLEM = parts.Benchmark(Parameters, build, _fall, reference, CHANNELS, PRINTED, 1e-5)
ENTRY = PROBLEM.entry(
    bodies="five bars, one loop",
    scene="fall",
    text="falls from rest",
    name="bricard",
    title="Bricard's mechanism (A04)",
    family="spatial-loop",
    summary="Benchmark A04: an overconstrained spatial loop that moves nevertheless.",
    checks=(moving_check("B3", build, "full", lambda p: (moving(p, time) for time in (0.2, 0.5))),),
    chain="6R",
    formulas="sum S_k rate_k = 0 over six unit twists, rank 5; the motion is along its null vector.",
    sources=("Bricard 1897", "Gonzalez, Gonzalez & Cuadrado: Benchmarking of multibody dynamics (IFToMM library), A04"),
)
