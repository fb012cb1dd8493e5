"""The checks of the delta pass as it is, and fail when a closed form, a builder or a run is wrong."""

import importlib
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6 import ENTRY
from mechlab.catalog.delta6.checks_motion import BETAS, RATES, terms_at_betas
from mechlab.catalog.delta6.elements import cardan_chain, output_turns
from mechlab.catalog.delta6.head import head_inertias
from mechlab.catalog.delta6.parameters import SOURCE, Delta6Parameters
from mechlab.catalog.delta6.poses import plants, reach, without_stops
from mechlab.errors import MechlabError
from mechlab.experiment.entry import CheckResult
from mechlab.experiment.scene import PRESETS
from mechlab.experiment.tree_plant import TreePlant
from mechlab.kit.checked_quantities import CheckedQuantity, check_quantities
from mechlab.mechanism import Builder, Inertia

CHECKS = ENTRY.checks
BY_ID = {c.id: c for c in CHECKS}
ENGINES = {"numpy", "pinocchio", "mujoco"}


def module(name: str) -> Any:
    return importlib.import_module(name)


BUILD = module("mechlab.catalog.delta6.build")
ANALYTIC = "mechlab.analytic.delta6."


def test_ids() -> None:
    assert [c.id for c in CHECKS] == [f"A{k}" for k in range(1, 17)]
    assert all(c.text and c.source for c in CHECKS)


@cache
def untouched(id_: str) -> CheckResult:
    """The check as it is, run once: `SOURCE` are the default parameters."""
    return BY_ID[id_].run(SOURCE)


@pytest.mark.parametrize("check", CHECKS, ids=lambda c: c.id)
def test_passes(check: Any) -> None:
    assert Delta6Parameters() == SOURCE
    measured = untouched(check.id)
    assert measured.passed, f"{measured.difference} > {measured.tolerance}: {measured.note}"


@pytest.mark.parametrize("id_", ["A1", "A2", "A3", "A4", "A5", "A7", "A8", "A12", "A13", "A14", "A15", "A16"])
def test_has_three_witnesses(id_: str) -> None:
    pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    said = {name.split()[0] for name in untouched(id_).values}
    assert said >= ENGINES or id_ == "A12" and said >= {"pinocchio", "mujoco"}


OTHERS: list[dict[str, Any]] = [
    {"rod_length": 0.5},
    {"rod_length": 0.5, "leg_azimuths": tuple(math.radians(a) for a in (-20, 95, 225)), "k_bevel": Fraction(17, 22)},
    {"head_offset": 0.0},
    {"rod_length": 0.25},  # bent by 66 deg at home, outside its slider range
    {"radial_offset": -0.2, "tangential_offset": 0.0},
    {"position_gain": 100.0, "velocity_gain": 20.0, "k_transfer": Fraction(2), "rod_mass": 0.2},
]


@pytest.mark.slow
@pytest.mark.parametrize("changes", OTHERS, ids=lambda c: "-".join(c))
def test_passes_for_other_parameters(changes: dict[str, Any]) -> None:
    p = replace(SOURCE, **changes)
    for check in CHECKS:
        measured = check.run(p)
        assert measured.passed, f"{check.id}: {measured.difference} > {measured.tolerance}: {measured.note}"


# -- something is wrong: at least one check must fail --------------------------------------------------------------------


@pytest.fixture
def fresh() -> Iterator[None]:
    """Mechanisms are kept between calls; a mutation must not meet an old one, nor leave one behind."""
    for f in (BUILD.build, cardan_chain):
        f.cache_clear()
    yield
    for f in (BUILD.build, cardan_chain):
        f.cache_clear()


def fails(id_: str) -> bool:
    """True when the check fails, or cannot be run because the mechanism is refused."""
    try:
        return not BY_ID[id_].run(Delta6Parameters()).passed
    except MechlabError:
        return True


def wrap(patch: pytest.MonkeyPatch, where: Any, name: str, make: Callable[[Any], Any]) -> None:
    patch.setattr(where, name, make(getattr(where, name)))


def flipped_fork(patch: pytest.MonkeyPatch) -> None:
    def make(f: Any) -> Any:
        return lambda *a: (lambda c: replace(c, upper_fork=-c.upper_fork))(f(*a))

    wrap(patch, closed, "cardan_angles", make)


def longer_lag(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module(ANALYTIC + "cardan"), "_lag", lambda f: lambda theta, c: 1.001 * f(theta, c))


def other_transfer(patch: pytest.MonkeyPatch) -> None:
    wrap(
        patch,
        BUILD,
        "_gears",
        lambda f: lambda b, p, s: f(b, replace(p, k_transfer=p.k_transfer + Fraction(1, 100)), s),
    )


def shafts_of_other_transfer(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, BUILD, "_shafts", lambda f: lambda b, p: f(b, replace(p, k_transfer=p.k_transfer + Fraction(1, 100))))


def gears_changed(change: Callable[[str, tuple[Any, Any], dict[str, Any]], tuple[Any, Any]]) -> Callable[..., None]:
    def mutate(patch: pytest.MonkeyPatch) -> None:
        def make(f: Any) -> Any:
            return lambda self, name, a, b, teeth, **o: f(self, name, a, b, change(name, teeth, o), **o)

        wrap(patch, Builder, "gears", make)

    return mutate


def _one_tooth(name: str, teeth: tuple[Any, Any], options: dict[str, Any]) -> tuple[Any, Any]:
    return (teeth[0], teeth[1] * Fraction(61, 60)) if name == "Pr2_planet2" else teeth


def _inside(name: str, teeth: tuple[Any, Any], options: dict[str, Any]) -> tuple[Any, Any]:
    if name == "N1_Pr1":
        options["kind"] = "internal"
    return teeth


def _other_side(name: str, teeth: tuple[Any, Any], options: dict[str, Any]) -> tuple[Any, Any]:
    if name == "Pz1_VZ":
        options["side"] = 1
    return teeth


def heavier_bevel(patch: pytest.MonkeyPatch) -> None:
    masses = module("mechlab.catalog.delta6.masses")
    patch.setattr(masses, "BEVEL", Inertia.axial(0.06, 1.5e-5, 1.02e-5, axis=(0.0, 1.0, 0.0)))


def one_rod_a_leg(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module("mechlab.catalog.delta6.masses"), "rod", lambda f: lambda p, leg, count=1: f(p, leg))


def lost_crosses(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, BUILD, "_with_lower_ends", lambda f: lambda p: f(replace(p, platform_mass=p.platform_mass - 0.01)))


def tool_off(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, BUILD, "_points", lambda f: lambda b, p: f(b, replace(p, head_offset=p.head_offset + 1e-6)))


def plain_rod_missing(patch: pytest.MonkeyPatch) -> None:
    wrap(
        patch,
        Builder,
        "loop",
        lambda f: lambda self, name, *a, **o: self if name == "plain1" else f(self, name, *a, **o),
    )


def short_distance(patch: pytest.MonkeyPatch) -> None:
    def make(f: Any) -> Any:
        return lambda self, name, *a, **o: f(
            self, name, *a, **(o | {"length": 0.999 * o["length"]} if "length" in o else o)
        )

    wrap(patch, Builder, "loop", make)


def other_side_of_the_guide(patch: pytest.MonkeyPatch) -> None:
    wrong = property(lambda g: -g.radial_offset * g.radial_directions - g.tangential_offset * g.tangential_directions)
    patch.setattr(closed.Delta6, "leg_offsets", wrong)


def no_centripetal(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module(ANALYTIC + "translation"), "_velocity_terms", lambda f: lambda *a: 0.99 * f(*a))


def beta_reversed(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module(ANALYTIC + "rotation"), "_signed", lambda f: lambda g, a, b: f(g, a, -b))


def tee_forgotten(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module(ANALYTIC + "head"), "_about_z", lambda f: lambda j: f(j) - 1e-6)


def slope_reversed(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module(ANALYTIC + "head"), "mass_matrix_slope", lambda f: lambda *a: -f(*a))


def slow_decay(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module(ANALYTIC + "control"), "_one_minus_exp", lambda f: lambda x: 1.001 * f(x))


def target_late(patch: pytest.MonkeyPatch) -> None:
    wrap(
        patch,
        module("mechlab.catalog.delta6.scenes"),
        "Sine",
        lambda f: lambda *a, **o: f(a[0], a[1] * 1.001, *a[2:], **o),
    )


def wrong_tip(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module(ANALYTIC + "mesh"), "tip_distance", lambda f: lambda *a: 1.001 * f(*a))


def wider_reach(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module(ANALYTIC + "workspace"), "squared_heights", lambda f: lambda g, x: f(g, x) + 1e-3)


def always_reached(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module(ANALYTIC + "translation"), "_squared_heights", lambda f: lambda g, x: np.abs(f(g, x)))


def wrong_determinant(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(closed, "orientation_determinant", lambda beta: np.abs(np.cos(beta)))


def axis_reversed(patch: pytest.MonkeyPatch) -> None:
    wrap(patch, module(ANALYTIC + "pose"), "output_axis", lambda f: lambda a: -f(a))


def soft_preset(patch: pytest.MonkeyPatch) -> None:
    patch.setitem(PRESETS, "accurate", PRESETS["defaults"])


MUTATIONS: list[tuple[Callable[[pytest.MonkeyPatch], None], str]] = [
    (flipped_fork, "A3"), (longer_lag, "A5"), (other_transfer, "A2"), (shafts_of_other_transfer, "A8"),
    (gears_changed(_one_tooth), "A2"), (gears_changed(_inside), "A2"), (gears_changed(_other_side), "A2"),
    (heavier_bevel, "A8"), (one_rod_a_leg, "A12"), (lost_crosses, "A12"), (tool_off, "A3"), (plain_rod_missing, "A4"),
    (short_distance, "A4"), (other_side_of_the_guide, "A1"), (no_centripetal, "A3"), (beta_reversed, "A2"),
    (tee_forgotten, "A8"), (slope_reversed, "A8"), (slow_decay, "A9"), (target_late, "A9"), (wrong_tip, "A10"),
    (wider_reach, "A6"), (always_reached, "A13"), (wrong_determinant, "A7"), (axis_reversed, "A14"), (soft_preset, "A11"),
    (lost_crosses, "A15"), (heavier_bevel, "A15"),
]  # fmt: skip


@pytest.mark.parametrize(("mutate", "id_"), MUTATIONS, ids=lambda x: getattr(x, "__name__", x))
def test_fails_when_something_is_wrong(
    mutate: Callable[[pytest.MonkeyPatch], None], id_: str, monkeypatch: pytest.MonkeyPatch, fresh: None
) -> None:
    assert untouched(id_).passed
    BUILD.build.cache_clear()
    cardan_chain.cache_clear()
    mutate(monkeypatch)
    assert fails(id_)


# -- pieces --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fidelity", ["minimal", "parts"])
@pytest.mark.parametrize(
    "changes", [{}, {"k_spur": Fraction(6, 5), "k_transfer": Fraction(3, 5), "k_bevel": Fraction(3, 4)}]
)
def test_planets_turn_against_the_carrier(fidelity: str, changes: dict[str, Fraction]) -> None:
    p = replace(SOURCE, **changes)
    real = head_inertias(p)
    mass, bias = terms_at_betas(TreePlant(BUILD.build(p, fidelity)), p, fidelity)
    np.testing.assert_allclose(mass, closed.mass_matrix(p.geometry, real, BETAS), atol=1e-12 * mass.max(), rtol=0)
    expected = closed.bias(real, np.array(BETAS), RATES)
    np.testing.assert_allclose(bias, expected, atol=1e-11 * np.abs(expected).max(), rtol=0)
    plus = closed.mass_matrix(p.geometry, replace(real, planet_sense=1), BETAS)
    assert np.abs(mass - plus).max() > 1e-3 * mass.max()


@pytest.mark.parametrize("sense", [0, 2, -3])
def test_planet_sense_is_a_sign(sense: int) -> None:
    with pytest.raises(MechlabError, match="planet_sense"):
        closed.HeadInertias(planet_sense=sense)


def test_cardan_chain_follows_the_closed_form() -> None:
    bend, misphase = 0.6, 0.3
    inputs = np.linspace(-3.0, 7.0, 15)
    start = 0.5 * math.pi
    expected = closed.misphase_output(inputs + start, bend, -misphase) - closed.misphase_output(start, bend, -misphase)
    for w in plants(cardan_chain(0.3, bend, misphase)).values():
        np.testing.assert_allclose(output_turns(w, inputs), expected, atol=1e-11)


def test_cardan_chain_refuses_a_right_angle() -> None:
    with pytest.raises(MechlabError, match="bend"):
        cardan_chain(0.3, 0.5 * math.pi)


def test_probes_stay_within_the_mechanism() -> None:
    p = without_stops(replace(SOURCE, rod_length=0.25))
    home = p.geometry.home_height + p.platform_height + p.slider_height
    assert p.slider_min < home < p.slider_max
    assert reach(p) == pytest.approx(0.25 - math.hypot(p.radial_offset, p.tangential_offset))


@pytest.mark.parametrize(
    "quantity",
    [
        CheckedQuantity("one witness alone", 1.0, {"a": 1.0}),
        CheckedQuantity("nobody", 1.0, {}, 1.0),
        CheckedQuantity("another shape", 1.0, {"a": [1.0, 2.0]}, [1.0]),
        CheckedQuantity("not finite", 1.0, {"a": math.nan}, 0.0),
        CheckedQuantity("beyond its limit", 0.1, {"a": 0.2}, 0.0),
        CheckedQuantity("witnesses that differ", 0.1, {"a": 0.2, "b": 0.4}),
    ],
    ids=lambda q: q.what,
)
def test_a_quantity_beyond_its_limit_fails(quantity: CheckedQuantity) -> None:
    good = CheckedQuantity("good", 1.0, {"a": 0.5, "b": 0.7})
    assert check_quantities(good).passed
    assert not check_quantities(good, quantity).passed


def test_the_note_lists_the_differences() -> None:
    measured = check_quantities(CheckedQuantity("length [m]", 0.5, {"a": 1.0, "b": 1.25}), note="why")
    assert measured.values == {"b": 0.5} and measured.tolerance == 1.0
    assert "length [m]: b 0.25 (limit 0.5)" in measured.note and measured.note.endswith("why")
