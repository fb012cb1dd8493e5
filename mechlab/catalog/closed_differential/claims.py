"""Claims of the paper on the gear CVT. E: the numeric example. K: speeds, power identities, starting and synthesis. Those on
its law are in `law.py`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.bibliography import GEAR_CVT
from mechlab.catalog.closed_differential import converter, law, starts
from mechlab.catalog.closed_differential.build import STATED_TEETH, USED_TEETH, Parameters, build
from mechlab.catalog.closed_differential.checks import EXAMPLE, LAB, SOLVERS, answers, rounded
from mechlab.catalog.closed_differential.questions import Machine, machine, mesh_sums
from mechlab.engines.protocol import WITNESSES as ENGINES
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.kit.claims import (
    Evidence,
    Ledger,
    below,
    evidence,
    factor,
    fails,
    holds,
    misprint,
    near,
    only_if,
    true,
    unreadable,
)

LEDGER = Ledger(GEAR_CVT)
PRINTED_SPEEDS = (50.0, 33.33, 200.0)
PRINTED_MOMENTS = (40.0, 60.0, 20.0, 180.0)
MILLI = 1e-3
NOTICED = 1e-3
"""An acceleration [rad/s2] beyond all rounding."""
SMALL = 1e-9
"""Limit of relative differences that only rounding makes."""

EXAMPLE_RULES = (
    holds(when=true("stated")),
    only_if("the train has the teeth {used_teeth}, which are the radii of the computation over the module; the stated teeth "
            "{stated_teeth} give {given}", when=true("used")),
    fails("no tooth set of the source gives these numbers"),
)  # fmt: skip


def _example(keys: Sequence[str], printed: Sequence[float], tolerance: float) -> Evidence:
    """A printed row of the example against all witnesses, for both tooth sets."""
    computed: dict[str, Any] = {}
    fits: dict[str, list[bool]] = {name: [] for name in EXAMPLE}
    for name, p in EXAMPLE.items():
        for who, values in answers(p, w_H1=100.0).items():
            row = [float(values[k]) for k in keys]
            computed[f"{who}, {name}"] = rounded(row)
            fits[name].append(bool(np.allclose(row, printed, rtol=0, atol=tolerance)))
    used, stated = (", ".join(map(str, teeth)) for teeth in (USED_TEETH, STATED_TEETH))
    given = ", ".join(f"{x:g}" for x in computed["analytic, stated teeth"])
    return evidence(computed, stated=fits["stated teeth"], used=fits["used teeth"], used_teeth=used, stated_teeth=stated,
                    given=given)  # fmt: skip


@LEDGER.claim(
    "E1", "example, steps 1 to 3", "w_H1 = 100 rad/s, M_H1 = 100 N m, M_H2 = 200 N m give w_H2, w3, w1.", list(PRINTED_SPEEDS),
    *EXAMPLE_RULES,
)  # fmt: skip
def example_speeds() -> Evidence:
    """w_H2, w3, w1."""
    return _example(("w_H2", "w3", "w1"), PRINTED_SPEEDS, 5e-3)


@LEDGER.claim(
    "E2", "example, moments on the wheels", "M21, M23, M54, M56 [N m].", list(PRINTED_MOMENTS), *EXAMPLE_RULES
)
def example_moments() -> Evidence:
    """M21, M23, M54, M56."""
    return _example(("M21", "M23", "M54", "M56"), PRINTED_MOMENTS, 1e-9)


@LEDGER.claim(
    "E3", "example, data", "Radii of the carriers for module 4 mm and the stated teeth.", "240, 400 mm",
    holds(when=true("as_printed")),
    misprint("{first:g} and {second:g} mm; the printed ones are the diameters. Harmless, only ratios enter", when=below(1e-9, "spread")),
    fails("the witnesses disagree"),
)  # fmt: skip
def carrier_radii() -> Evidence:
    """Radii of the planet axes for module 4 mm and the stated teeth, from the poses of the models."""
    p = replace(EXAMPLE["stated teeth"], module=4 * MILLI)
    m = build(p, "parts")
    computed = {"analytic: m (z1 + z2)/2, m (z4 + z5)/2 [mm]": rounded(np.array(p.radii) / MILLI)}
    for name in ENGINES:
        origins = [engine(name).plant(m).pose(f"{s.planet}_1")[1] for s in p.stages]
        computed[f"{name}: distance of the axes [mm]"] = rounded([np.hypot(*x[:2]) / MILLI for x in origins])
    found = np.array(list(computed.values()))
    as_printed = np.isclose(found, [240.0, 400.0])
    return evidence(
        computed, as_printed=as_printed, spread=np.ptp(found, axis=0), first=found[0, 0], second=found[0, 1]
    )


@LEDGER.claim(
    "E4", "example, from (18)", "The bracket of w3 = [50(1+9) - 100(1+15)]/(-15+9), as the scan shows it.", "1+15",
    holds(when=near("*: w3", 1e-9, of="analytic: w3 with 1 + 15")),
    unreadable("1 + 1.5, as u13 = -1.5: the commas are lost here and in -15 + 9; the printed result 33.33 has them",
               when=near("*: w3", 1e-9, of="analytic: w3 with 1 + 1.5")),
    fails("neither reading gives the printed result"),
)  # fmt: skip
def bracket() -> Evidence:
    """The bracket (1+15) in the formula for w3, read as printed and as 1 + 1.5."""
    train = EXAMPLE["used teeth"].train
    computed = {
        f"analytic: w3 with 1 + {x:g}": rounded((50.0 * (1 - train.u46) - 100.0 * (1 + x)) / (train.u13 - train.u46))
        for x in (15.0, 1.5)
    }
    computed |= {f"{who}: w3": float(v["w3"]) for who, v in answers(EXAMPLE["used teeth"], w_H1=100.0).items()}
    return evidence(computed)


@LEDGER.claim(
    "E5", "example, formula for w1", "w1 is computed from (17) with the factor -1.5.", "(17)",
    holds(when=near("analytic: factor of (17)", 1e-9, of=-1.5)),
    misprint("(16): the factor -1.5 is u13. Both formulas give the same w1",
             when=near("analytic: factor of (16)", 1e-9, of=-1.5) & near("by_16", 1e-9, of="by_17")),
    fails("neither formula has this factor"),
)  # fmt: skip
def step_label() -> Evidence:
    """The step 'from (17)': -1.5 (33.33 - 100) + 100."""
    p = EXAMPLE["used teeth"]
    train, v = p.train, closed.speeds(p.train, w_H1=100.0, w_H2=50.0)
    by_16, by_17 = train.u13 * (v.w3 - v.w_H1) + v.w_H1, train.u46 * (v.w3 - v.w_H2) + v.w_H2
    computed = {"analytic: factor of (16)": train.u13, "analytic: factor of (17)": train.u46,
                "analytic: w1 by (16)": rounded(by_16), "analytic: w1 by (17)": rounded(by_17)}  # fmt: skip
    computed |= {f"{who}: w1": rounded(x["w1"]) for who, x in answers(p, w_H1=100.0).items() if who != "analytic"}
    return evidence(computed, by_16=by_16, by_17=by_17)


@LEDGER.claim(
    "K1", "equations (14) to (18)", "Speeds of the blocks from those of the carriers.", "(14)-(18)",
    holds("for z1/z3 other than z4/z6", when=below(SMALL, "*: largest difference of w1, w3, relative")),
    fails("the gear rows give other speeds"),
)  # fmt: skip
def kinematics() -> Evidence:
    """(16), (18) against the gear rows, for random speeds and both tooth sets."""
    rng = np.random.default_rng(5)
    worst = dict.fromkeys(SOLVERS, 0.0)
    for p in (*EXAMPLE.values(), LAB):
        for h1, h2 in rng.uniform(-200.0, 200.0, (4, 2)):
            printed = vars(closed.printed_speeds(p.train, h1, h2))
            for who, values in answers(p, w_H1=h1, w_H2=h2).items():
                gap = max(abs(float(values[k]) - float(printed[k])) for k in ("w1", "w3"))
                worst[who] = max(worst[who], gap / 1e3)
    return evidence({f"{who}: largest difference of w1, w3, relative": v for who, v in worst.items()})


@LEDGER.claim(
    "K2", "equation (13)", "z3 = z1 + 2 z2, z6 = z4 + 2 z5.", "(13)",
    holds("equal spacing and neighbours of the planets must be met besides", when=true("fits")),
    fails("gears fit without it"),
)  # fmt: skip
def coaxial() -> Evidence:
    """(13): the planet axis must lie at m (sun + planet)/2 for the sun and at m (ring - planet)/2 for the ring."""
    computed: dict[str, Any] = {}
    fits = []
    for more in (-1, 0, 1):
        sun, planet, ring = LAB.teeth[0], LAB.teeth[1], LAB.teeth[0] + 2 * LAB.teeth[1] + more
        gap = 0.5 * LAB.module * ((ring - planet) - (sun + planet))
        try:
            closed.Train(sun, planet, ring, *LAB.teeth[3:])
            accepted = True
        except MechlabError:
            accepted = False
        computed[f"analytic: axes apart with z3 = z1 + 2 z2 {more:+d} [m]"] = rounded(gap)
        fits.append(accepted == (abs(gap) < 1e-12))
    return evidence(computed, fits=fits)


def _held_loads(made: Machine, M_H1: float, M_H2: float) -> dict[str, float]:
    """Moments of the meshes on the wheels 1, 3, 4, 6 with both blocks held [N m]."""
    return mesh_sums(made.balance(made.applied(w_H1=M_H1, w_H2=-M_H2), ["w1", "w3"])[1])


@LEDGER.claim(
    "K3", "equation (7)", "The power on both blocks is the power of the outer moments.", "(7)",
    holds("an identity for balanced planets, at any speeds and moments: it fixes nothing", when=below(SMALL, "*: largest gap, relative")),
    fails("the powers differ"),
)  # fmt: skip
def power_identity() -> Evidence:
    """(7): power of the meshes on the blocks against the power of the outer moments, at random speeds."""
    rng = np.random.default_rng(6)
    computed: dict[str, Any] = {}
    states = rng.uniform(-100.0, 100.0, (3, 4))
    gaps = []
    for h1, h2, m1, m2 in states:
        v, m = closed.speeds(LAB.train, w_H1=h1, w_H2=h2), closed.mesh_moments(LAB.train, m1, m2)
        gaps.append(abs((m.M21 - m.M54) * v.w1 + (m.M23 - m.M56) * v.w3 - m1 * h1 + m2 * h2) / 1e4)
    computed["analytic: largest gap, relative"] = float(max(gaps))
    for who in ENGINES:
        made = machine(who, LAB, "parts")
        gaps = []
        for h1, h2, m1, m2 in states:
            rates, load = made.rates({"w_H1": h1, "w_H2": h2}), _held_loads(made, m1, m2)
            blocks = (load["mesh_12"] + load["mesh_45"]) * (made.row("w1") @ rates)
            blocks += (load["mesh_23"] + load["mesh_56"]) * (made.row("w3") @ rates)
            gaps.append(abs(float(blocks) - m1 * h1 + m2 * h2) / 1e4)
        computed[f"{who}: largest gap, relative"] = float(max(gaps))
    return evidence(computed)


@LEDGER.claim(
    "K4", "equations (1) to (4)",
    "With M_H2 = M_H1 there is equilibrium: the moments on the blocks cancel and the train turns as one.", "M_H2 = M_H1",
    holds(when=near("*: dL/dt [N m]", 1e-6, of=0.0) & below(NOTICED, "sizes")),
    fails("the moments on the blocks are opposite, which keeps the angular momentum of the whole; but each is {moment:g} N m, and "
          "blocks and carriers gain speed (H1 {carrier:.4g} rad/s2, block 14 {block:.4g} rad/s2). (9) in motion, L2, is no "
          "equilibrium either",
          when=near("*: dL/dt [N m]", 1e-6, of=0.0) & near("sum", 1e-9, of=0.0)),
    fails("the moments on the blocks do not cancel"),
)  # fmt: skip
def equal_moments() -> Evidence:
    """(1), (4): with M_H2 = M_H1 the moments on the blocks are opposite and dL/dt = 0; but do the parts keep their speeds?"""
    p = replace(LAB, M_H2=LAB.M_H1)
    q = closed.block_torques(p.train, p.M_H1, p.M_H2)
    row = closed.momentum_row(p.train, p.inertias)
    computed: dict[str, Any] = {"analytic: M1, M3 [N m]": rounded(q)}
    rates = {}
    for who, values in answers(p, w_H1=100.0, w_H2=100.0).items():  # turning as one
        rates[who] = [float(values[f"{n}_rate"]) for n in ("w_H1", "w_H2", "w1", "w3")]
        computed[f"{who}: dL/dt [N m]"] = rounded(row @ rates[who][2:], 6)
        computed[f"{who}: accelerations of H1, H2, blocks 14, 36 [rad/s2]"] = rounded(rates[who], 4)
    carrier, _, block, _ = rates["analytic"]
    return evidence(computed, sum=q.sum(), sizes=np.abs(list(rates.values())), moment=abs(q[0]), carrier=carrier, block=block)


@LEDGER.claim(
    "K5", "starting ratio", "u_H1-5 = (z3 z4 - z6 z1)/(z3 z4 + z1 z4) z5/z6 with the output held.", "u_H1-5",
    holds(when=below(SMALL, "spread")),
    fails("the gear rows give another ratio"),
)  # fmt: skip
def start_ratio() -> Evidence:
    """u_H1-5 with the output held."""
    computed, spread = dict[str, Any](), list[float]()
    for name, p in EXAMPLE.items():
        ratios = {who: float(v["start_ratio"]) for who, v in answers(p, w_H1=100.0).items()}
        computed |= {f"{who}, {name}": rounded(v) for who, v in ratios.items()}
        spread.append(max(ratios.values()) - min(ratios.values()))
    return evidence(computed, spread=spread)


PARTS = {
    "J5": "only planets 5",
    "J36": "only block 36",
    "J14": "only block 14",
    "J2": "only planets 2",
    "": "lab inertias",
}


def only(part: str) -> Parameters:
    """The lab train with every inertia but that of `part` times 1e-9. part: one of PARTS, "" for all as they are."""
    light = {k: getattr(LAB, k) * 1e-9 for k in ("J_H1", "J14", "J36", "J_H2", "J2", "m2", "J5", "m5") if k != part}
    return replace(LAB, **light) if part else LAB


@LEDGER.claim(
    "K6", "starting formula", "The output starts when M_H1 r_H2/(2 r_H1) (r1/r4 + r3/r6) exceeds the load.", "M_H2,start",
    holds(when=factor("all", 1.0, 1e-4, of="printed")),
    only_if("planets 5 alone have inertia: the moment on a held output is purely inertial, -Jh12/Jh11 M_H1, and depends on "
            "how the inertia is spread ({least:.4g} to {most:.4g} N m here). It is gone when the input no longer accelerates",
            when=factor("planets_5", 1.0, 1e-4, of="printed")),
    fails("no inertia makes it true"),
)  # fmt: skip
def start_moment() -> Evidence:
    """Moment on the held output at the start, by each witness, where only one part has inertia."""
    printed = float(closed.start_moment(LAB.train, LAB.M_H1))
    computed: dict[str, Any] = {"analytic: the printed formula [N m]": rounded(printed)}
    found: dict[str, list[float]] = {}
    for part, text in PARTS.items():
        for who, values in answers(only(part), w_H1=100.0, w_H2=0.0).items():
            found.setdefault(part, []).append(float(values["held_output_moment"]))
            computed[f"{who}: {text} have inertia"] = rounded(found[part][-1], 4)
    first = [v[0] for v in found.values()]
    every = sum(found.values(), list[float]())
    return evidence(computed, printed=printed, all=every, planets_5=found["J5"], least=min(first), most=max(first))


@LEDGER.claim(
    "K7", "equation (12)", "z4 R54 - z1 R21 = z3 R23 - z6 R56 with (13) determines the teeth.", "(12)",
    holds(when=true("solved")),
    fails("it is (11) with w1 = w3 silently taken and says no more than M_H1 = M_H2; for the data of the example it gives a "
          "negative z4. Choose teeth from the ratios with one block braked instead, a/b and (1-a)/(1-b)"),
)  # fmt: skip
def synthesis() -> Evidence:
    """(12) with (13): z4 = (z1 + z2) F/R - z5, for the example's own z1, z2, z5."""
    computed: dict[str, Any] = {}
    solved = []
    for name, p in EXAMPLE.items():
        t = p.train
        # F/R = (M_H1/r_H1)/(M_H2/r_H2); r_H as z1 + z2, z4 + z5
        ratio = p.M_H1 / (t.z1 + t.z2) / (p.M_H2 / (t.z4 + t.z5))
        z4 = closed.printed_z4(t.z1, t.z2, t.z5, ratio)
        computed[f"analytic: z4 by (12) and (13), {name}"] = rounded(z4)
        left, right = t.z4 / ratio - t.z1, t.z3 - t.z6 / ratio
        computed[f"analytic: sides of (12) over F/2, {name}"] = rounded([left, right])
        solved.append(z4 > 0 and abs(z4 - t.z4) < 1e-9)
        for who in ENGINES:
            load = _held_loads(machine(who, p, "parts"), p.M_H1, p.M_H2)
            sides = [-load["mesh_45"] - load["mesh_12"], load["mesh_23"] + load["mesh_56"]]
            computed[f"{who}: M54 - M21, M23 - M56 [N m], {name}"] = rounded(sides)
    return evidence(computed, solved=solved)


CLAIMS = (*LEDGER.claims, *law.CLAIMS, *converter.CLAIMS, *starts.CLAIMS)
FIGURES = (*law.FIGURES, *converter.FIGURES, *starts.FIGURES)
