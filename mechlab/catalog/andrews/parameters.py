"""Parameters of the squeezer, and its closed form."""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.analytic.benchmarks import Squeezer
from mechlab.experiment.parameters import parameter

SOURCE = "Bari Test Set, Andrews' squeezing mechanism"
JOINTS = ("beta", "Theta", "gamma", "Phi", "delta", "Omega", "epsilon")
START = (
    -0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885885, 0.487364979543842550,
    -0.222668390165885885, 1.23054744454982119,
)  # fmt: skip


@dataclass(frozen=True)
class Parameters:
    """Lengths as in the Test Set (Hairer & Wanner, VII.7); masses and moments of K1 to K7."""

    torque: float = parameter(0.033, "N m", "torque on the crank at O", source=SOURCE)
    spring_stiffness: float = parameter(4530.0, "N/m", "spring from C to D", source=SOURCE, low=0)
    spring_length: float = parameter(0.07785, "m", "its length without force", source=SOURCE, low=0)
    masses: tuple[float, float, float, float, float, float, float] = parameter(
        (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498),
        "kg",
        "masses of K1 to K7",
        source=SOURCE,
        low=0,
        strict=True,
    )
    inertias: tuple[float, float, float, float, float, float, float] = parameter(
        (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5), "kg m2", "moments about the centres of mass",
        source=SOURCE, low=0, strict=True,
    )  # fmt: skip
    a: tuple[float, float] = parameter((-0.06934, -0.00227), "m", "pivot A of K5 and K7", source=SOURCE)
    b: tuple[float, float] = parameter((-0.03635, 0.03273), "m", "pivot B of K3", source=SOURCE)
    c: tuple[float, float] = parameter((0.014, 0.072), "m", "anchor C of the spring", source=SOURCE)
    d: float = parameter(0.028, "m", "K2, from F to E", source=SOURCE, low=0, strict=True)
    da: float = parameter(0.0115, "m", "F to the centre of K2", source=SOURCE, low=0)
    e: float = parameter(0.02, "m", "K4, from G to E", source=SOURCE, low=0, strict=True)
    ea: float = parameter(0.01421, "m", "E to the centre of K4", source=SOURCE, low=0)
    rr: float = parameter(0.007, "m", "crank K1, from O to F", source=SOURCE, low=0, strict=True)
    ra: float = parameter(0.00092, "m", "O to the centre of K1", source=SOURCE, low=0)
    ss: float = parameter(0.035, "m", "K3, from B to E", source=SOURCE, low=0, strict=True)
    sa: float = parameter(0.01874, "m", "centre of K3 along B-E", source=SOURCE)
    sb: float = parameter(0.01043, "m", "centre of K3 across B-E", source=SOURCE)
    sc: float = parameter(0.018, "m", "D along B-E", source=SOURCE)
    sd: float = parameter(0.02, "m", "D across B-E", source=SOURCE)
    ta: float = parameter(0.02308, "m", "centre of K5 along A-G", source=SOURCE)
    tb: float = parameter(0.00916, "m", "centre of K5 across A-G", source=SOURCE)
    zt: float = parameter(0.04, "m", "K5, from A to G", source=SOURCE, low=0, strict=True)
    u: float = parameter(0.04, "m", "K7, from A to H", source=SOURCE, low=0, strict=True)
    ua: float = parameter(0.01228, "m", "centre of K7 along A-H", source=SOURCE)
    ub: float = parameter(0.00449, "m", "centre of K7 across A-H", source=SOURCE)
    zf: float = parameter(0.02, "m", "K6, from H to E", source=SOURCE, low=0, strict=True)
    fa: float = parameter(0.01421, "m", "E to the centre of K6", source=SOURCE, low=0)
    gravity: float = parameter(0.0, "m/s2", "gravity, along -y", source=SOURCE)
    start_angle: float = parameter(START[0], "rad", "crank angle at the start", source=SOURCE)
    start_rate: float = parameter(0.0, "rad/s", "crank speed at the start", source=SOURCE)
    duration: float = parameter(0.05, "s", "duration of the scene", source=SOURCE, low=0, strict=True)


def own(p: Parameters) -> Squeezer:
    """The equation of the crank."""
    names = "a b c d da e ea rr ra ss sa sb sc sd zt ta tb u ua ub zf fa torque spring_stiffness spring_length gravity"
    same = {n: getattr(p, n) for n in names.split()}
    return Squeezer(masses=p.masses, inertias=p.inertias, start=START, **same)
