"""The injector itself, and a sample of its faults; all 200 are run by `python -m tests.benchmarks.fault_injection`."""

from __future__ import annotations

import numpy as np
import pytest

import mechlab.catalog.fourbar as fourbar
from mechlab import catalog
from mechlab.analytic.fourbar import kinematics
from mechlab.engines.mujoco import model as simulate_model
from mechlab.experiment.entry import Check
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.lab.design import design
from mechlab.studies.check.check import checks_of
from tests.faults import builders, formulas
from tests.faults.hunt import draw, hunt
from tests.faults.marks import marks
from tests.faults.patch import replaced

SAMPLE = (
    (0, "pendulum"), (1, "slider_crank"), (42, "n_fourbar"), (63, "bricard"), (24, "andrews"), (165, "flyball"), (186, "planetary"),
    (187, "planetary_stage"), (128, "wolfrom"), (69, "fivebar"), (190, "quick_return"), (171, "stephenson"), (192, "platform_3rrr"),
    (154, "fourbar"), (75, "delta6"), (78, "gear_linkage"), (59, "closed_differential"), (116, "impulse_transmission"),
    (97, "prosthetic_leg"), (73, "class4_linkage"),
)  # fmt: skip
"""Seeds and mechanisms."""


def cheap_first(check: Check) -> float:
    """The generic checks, then the others in their order."""
    return 0.0 if check.id.startswith("G") else 1.0 + check.slow


def test_a_function_is_replaced_wherever_it_is_held_and_put_back() -> None:
    d = design(catalog.entry("fourbar"), {})
    before = d.mechanism()
    for _ in range(3):  # again and again in one process
        with replaced(fourbar.build, lambda f: lambda p, fidelity: "wrong") as places:
            assert (
                places == 5
            )  # its module, the entry, what generates from it, the engines as witnesses, the check of masses
            assert all(x.build(d.parameters, "minimal") == "wrong" for x in (fourbar, fourbar.CRANK))
            assert d.entry.build is fourbar.build and d.mechanism() == "wrong"
    assert d.mechanism() == before and d.entry.build is fourbar.build
    with replaced(to_mjcf, lambda f: lambda *a, **k: "<mujoco/>"):
        assert simulate_model.to_mujoco(before)[0].nbody == 1  # the compiled model was forgotten
    assert simulate_model.to_mujoco(before)[0].nbody > 1
    with pytest.raises(ZeroDivisionError), replaced(kinematics.solve, lambda f: lambda *a, **k: 1 / 0):
        fourbar.build(d.parameters, "minimal")
    assert fourbar.build(d.parameters, "minimal") == before


def test_a_seed_gives_the_same_fault_and_it_changes_something() -> None:
    for seed in range(12):
        fault, again = draw(seed, "pendulum"), draw(seed, "pendulum")
        assert (fault.text, fault.family, fault.kind) == (again.text, again.family, again.kind)
    m = design(catalog.entry("pendulum"), {}).mechanism()
    right = marks(m)
    assert not builders.differ(right, marks(m))
    alter = builders.FAULTS["inertia"][0](np.random.default_rng(0), m)
    assert alter is not None and builders.differ(right, marks(alter[1](m)))
    # Turned about a frame that is the identity: nothing changes, and it is told from a fault.
    same = builders.swap(m, "bodies", m.bodies[0].name, lambda b: b)
    assert not builders.differ(right, marks(same))


def test_every_kind_and_family_is_drawn() -> None:
    drawn = [draw(seed, name) for seed in range(25) for name in ("fourbar", "planetary", "flyball")]
    assert {f.kind for f in drawn} == {"sign", "frame", "tooth", "inertia", "row", "unit"}
    assert {f.family for f in drawn} == {"builder", "MJCF writer", "Pinocchio writer", "closed form"}
    assert len({(f.mechanism, f.text) for f in drawn}) > 40


def test_a_formula_is_changed_in_one_place() -> None:
    fault = formulas.FormulaFault(1, "sign", "other sign", lambda x: -x)
    wrong = fault(lambda x: {"a": x, "b": (np.array([1.0, 2.0]), "text")})
    right = {"a": 3.0, "b": (np.array([1.0, 2.0]), "text")}
    found = wrong(3.0)
    paths = list(formulas.leaves(right))
    assert paths == [("a",), ("b", 0)] and fault.fired and fault.path in paths
    changed = [p for p in paths if not np.array_equal(formulas._at(found, p), formulas._at(right, p))]
    assert changed == [fault.path]
    assert {n for n, _ in formulas.functions_of("fourbar")} >= {"fourbar.kinematics.solve"}


def test_without_a_fault_the_generic_checks_pass() -> None:
    d = design(catalog.entry("slider_crank"), {})
    outcomes = {c.id: c.run(d.parameters).passed for c in checks_of(d.entry) if c.id.startswith("G")}
    assert len(outcomes) == 6 and all(outcomes.values())


@pytest.mark.parametrize(("seed", "name"), SAMPLE)
def test_a_fault_is_caught(seed: int, name: str) -> None:
    fault = draw(seed, name)
    verdict = hunt(fault, cheap_first)
    assert verdict.caught, f"{fault.family}, {fault.kind}: {fault.text} escapes the checks of {name}"
