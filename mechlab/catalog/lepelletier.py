"""The Lepelletier train: a simple stage before a Ravigneaux set, six forward gears from five clutches and brakes."""

from __future__ import annotations

from mechlab.errors import MechlabError
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter, ratio
from mechlab.kit.train import Train
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism

TABLE = {1: 4.171, 2: 2.340, 3: 1.521, 4: 1.143, 5: 0.867, 6: 0.691}  # ZF 6HP26 as its maker prints them
CLUTCHES = {1: "AD", 2: "AC", 3: "AB", 4: "AE", 5: "BE", 6: "CE"}


@dataclass(frozen=True)
class Parameters:
    """Teeth of the ZF 6HP26; `gear` says which clutches are closed."""

    gear: int = parameter(1, "", "gear that is engaged; not 3, in which the rear set turns as a block", low=1, high=6)
    front: tuple[int, int] = parameter((37, 71), "", "sun and ring of the simple stage", low=12)
    rear: tuple[int, int, int] = parameter((31, 38, 85), "", "small sun, large sun, ring of the Ravigneaux set", low=12)


def build(p: Parameters) -> Mechanism:
    """The front sun stands still. Free members: input with the front ring, the rear carrier, the large sun, by the clutch of the gear."""
    if p.gear == 3:
        raise MechlabError("lepelletier: gear: 3 locks the planets, the rear set is one block of ratio 1 + s1 / r1; give another.")
    t, (s1, r1), (s2, s3, r2) = Train("lepelletier", 0.0015, "Lepelletier six-speed train"), p.front, p.rear
    small, long = (r1 - s1) // 2, (r2 - s3) // 2
    first, far, near = t.centres(s1, small), t.centres(s3, long), t.centres(s2, long)
    t.wheel("sun_1", s1, -3).wheel("ring_1", r1, -3, ring=True).carrier("arm_1", [first], -4.2).wheel("sun_2", s2, -1)
    t.planet("planet_1", "arm_1", small, first, level=-3).mesh_of("sun_1", "planet_1", "arm_1").mesh_of("ring_1", "planet_1", "arm_1")
    t.wheel("sun_3", s3, 0).wheel("ring_2", r2, 0, ring=True).carrier("arm_2", [far, near], 1.2).planet("long", "arm_2", long, far)
    t.planet("short", "arm_2", long, near, 0.9, -1).mesh_of("sun_3", "long", "arm_2").mesh_of("ring_2", "long", "arm_2")
    t.mesh_of("sun_2", "short", "arm_2").mesh_of("short", "long", "arm_2").relation("brake_1", sun_1=1)
    rows = {"A": {"sun_2": 1, "arm_1": -1}, "C": {"sun_3": 1}, "D": {"arm_2": 1}, "B": {"sun_3": 1, "arm_1": -1},
            "E": {"arm_2": 1, "ring_1": -1}}
    for clutch in CLUTCHES[p.gear]:
        t.relation(f"clutch_{clutch}", **rows[clutch])
    return t.drive("ring_1", stiffness=20.0, damping=0.2).build()


def willis(p: Parameters) -> float:
    """Input over output from two equations in rear carrier c and ring r: small sun c + one (r - c), large sun c - two (r - c)."""
    (s1, r1), (s2, s3, r2) = p.front, p.rear
    slow, one, two = r1 / (r1 + s1), r2 / s2, r2 / s3  # slow: front carrier for an input of 1
    rows = {"A": (1 - one, one, slow), "B": (1 + two, -two, slow), "C": (1 + two, -two, 0), "D": (1, 0, 0), "E": (1, 0, 1)}
    (a, b, x), (c, d, y) = (rows[k] for k in CLUTCHES[p.gear])
    return (a * d - b * c) / (a * y - c * x)


ENTRY = builder_entry(
    "lepelletier", "Lepelletier train", "gear-train", summary="A simple stage and a Ravigneaux set: six gears of an automatic gearbox.",
    use="Automatic gearboxes with six gears and few parts.", origin="Pierre Lepelletier, 1990; ZF 6HP26, 2001", parameters=Parameters,
    build=build, path=lambda p: {"ring_1": (0.0, 6.283185307179586)}, plots=(PlotRecipe("output", ("ring_2_rate",)),),
    outside=(Outside("ratio by Willis", "", willis, lambda p, m: ratio(m, "ring_1", "ring_2"), 1e-9, "Willis 1841"),
             Outside("ratio as printed", "", lambda p: TABLE[p.gear], lambda p, m: ratio(m, "ring_1", "ring_2"), 6e-4, "ZF 6HP26")),
    chain="planetary", formulas="Willis equation of each stage.", sources=("ZF 6HP26", "Willis, Principles of Mechanism, 1841"),
)  # fmt: skip
