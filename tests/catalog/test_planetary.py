"""The series-planet gear in the catalog. MuJoCo 4.0.0, Pinocchio 4.1.0."""

import math
from fractions import Fraction

import pytest

import mechlab as ml
from mechlab import shapes
from mechlab.analytic.planetary_synthesis import series_planets
from mechlab.catalog.planetary import CHECKS, Parameters, build, phases
from mechlab.catalog.planetary.claims import CLAIMS
from mechlab.errors import MechlabError
from mechlab.experiment.entry import Verdict
from mechlab.mechanism import structure


@pytest.mark.parametrize("sizes", [(18, 36, 18, 90), (20, 43, 35, 100), (21, 20, 30, 42)])
@pytest.mark.parametrize("check", CHECKS, ids=lambda c: c.id)
def test_checks_pass(check: object, sizes: tuple[int, ...]) -> None:
    assert check.run(Parameters(teeth=sizes)).passed  # type: ignore[attr-defined]


@pytest.mark.parametrize("ratio", (3, 4, 6, Fraction(17, 3)))
def test_a_solution_of_the_synthesis_has_the_ratio(ratio: Fraction) -> None:
    found = series_planets(ratio, 3)
    for k in (0, len(found) // 2, -1):
        teeth = tuple(int(z[k]) for z in (found.z1, found.z2, found.z3, found.z4))
        answers = ml.solve("planetary", teeth=teeth, carrier_rate=1.0)
        assert answers.max_difference is not None and answers.max_difference < 1e-9
        assert math.isclose(answers["mujoco"]["sun_rate"], float(ratio), rel_tol=1e-12)
        assert structure(build(Parameters(teeth=teeth), "minimal")).rank == 0


def test_fidelities() -> None:
    p = Parameters()
    found = {f: structure(build(p, f)) for f in ("minimal", "parts", "full")}
    assert [found[f].nv - found[f].rank for f in found] == [1, 1, 1]
    assert not found["parts"].redundant and len(found["full"].redundant) == 2


def test_teeth_are_in_phase_on_every_ray_only_when_they_assemble() -> None:
    def misfit(p: Parameters) -> float:
        """Largest distance of gear 4, as ray k wants it, from gear 4 as ray 0 wants it, in pitches (at most 1/2)."""
        off = [(phases(p, k)[2] - phases(p, 0)[2]) * p.teeth[3] / (2 * math.pi) for k in range(p.planets)]
        return max(abs(x - round(x)) for x in off)

    for sizes, planets in (((18, 36, 18, 90), 4), ((20, 43, 35, 100), 3), ((40, 20, 20, 80), 5)):
        p = Parameters(teeth=sizes, planets=planets)
        m = build(p, "full")
        assert sum(b.name.startswith("planet_2") for b in m.bodies) == planets
        assert misfit(p) < 1e-9
    refused = Parameters()  # 5 rays, past the check of its constructor: (18 + 90) / 5 leaves 3
    object.__setattr__(refused, "planets", 5)
    assert misfit(refused) == pytest.approx(0.4, abs=1e-9)  # 108 k / 5 lies 0.4 off a whole number at worst
    with pytest.raises(MechlabError, match="not whole"):
        Parameters(planets=5)
    with pytest.raises(MechlabError, match="overlap"):
        Parameters(planets=6)
    with pytest.raises(MechlabError, match="at most z1"):
        Parameters(teeth=(18, 30, 18, 90))


def test_claims() -> None:
    assert {c.id: c.test().verdict for c in CLAIMS} == {
        "Y1": Verdict.HOLDS, "Y2": Verdict.FAILS, "Y3": Verdict.FAILS, "Y4": Verdict.HOLDS_ONLY_IF, "Y5": Verdict.UNREADABLE,
        "Y6": Verdict.HOLDS,
    }  # fmt: skip


def test_all_shapes_can_be_built() -> None:
    for sizes in ((18, 36, 18, 90), (20, 43, 35, 100)):
        for fidelity in ("minimal", "full"):
            m = build(Parameters(teeth=sizes), fidelity)
            shown = [
                *m.ground_shapes,
                *(s for b in m.bodies for s in b.shapes),
                *(s for x in m.shafts for s in x.shapes),
            ]
            for s in shown:
                assert shapes.is_watertight(shapes.mesh(s.kind, s.parameters)), s.name
