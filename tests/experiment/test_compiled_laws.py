"""Laws compiled to matrices, against the forces that each law states by itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import mechlab as ml
from mechlab.experiment.held_rates import ViscousBetween
from mechlab.experiment.laws import (
    ComputedTorque,
    Constant,
    ConstantPower,
    DcMotor,
    FunctionLaw,
    Harmonic,
    Law,
    Motor,
    OneSidedStop,
    Plant,
    Servo,
    TableLaw,
    Viscous,
    applied_force,
)
from mechlab.experiment.laws.compiled import CompiledLaws, StateOrder
from mechlab.experiment.laws.user import laws_of
from mechlab.experiment.motion import AtRate, Function, Hold, Polyline, Ramp, Sine, Spline
from mechlab.experiment.motion_basis import TimeBasis
from mechlab.experiment.tree_plant import TreePlant
from mechlab.mechanism import Inertia, Mechanism, prismatic, revolute, spherical


class Late(Sine):
    """A sine that begins later: derived, with values of its own."""

    def at(self, t: float) -> tuple[float, float, float]:
        return super().at(t - 0.3)


MOTIONS = (
    AtRate(AtRate(Sine(1.0, 3.0))), Late(0.4, 7.0, 0.3), Late(0.4, 7.0, 0.3), AtRate(Ramp(0.1, -2.0)),
    Hold(0.3), Ramp(0.1, -2.0), Sine(0.4, 7.0, 0.3, 0.1), Sine(0.2, 7.0, 0.3), Sine(0.2, 5.0), AtRate(Sine(1.0, 3.0)),
    Function(lambda t: (t * t, 2.0 * t, 2.0)), Spline((0.0, 0.2, 0.5, 0.6, 0.9, 1.3, 1.5), (0.0, 1.0, -1.0, 2.0, 0.5, 0.1, 0.2)),
    Spline((0.0, 0.2, 0.5, 0.6, 0.9, 1.3, 1.5), (1.0, 1.0, 0.0, 2.0, 3.0, 0.1, 0.2)), Spline((0.0, 0.4, 1.0), (0.0, 1.0, 3.0)),
    Spline((0.0, 0.4, 1.0, 1.2), (0.0, 1.0, 3.0, 1.0)), Polyline((0.1, 0.4, 1.2), (2.0, -1.0, 0.5)),
)  # fmt: skip

LAWS: tuple[Law, ...] = (
    Constant("slide", 2.0), Harmonic("hip", 1.5, 9.0, 0.2, 0.4), TableLaw("slide", (0.0, 0.5, 1.0), (1.0, -2.0, 3.0)),
    ConstantPower("hip", 3.0, 2.0), Viscous("wheel", 0.7), OneSidedStop("slide", 0.1, 1, 40.0, 2.0),
    OneSidedStop("slide", 0.1, -1, 40.0, 2.0),
    Motor("wheel", 2.0, 30.0), DcMotor("hip", Sine(4.0, 6.0), 0.3, 2.0), DcMotor("wheel", 5.0, 0.2, 1.5, 0.01, 0.4),
    Servo("hip", Sine(0.5, 4.0), 30.0, 2.0, 0.7), Servo("slide", Ramp(0.0, 1.0), 50.0, 3.0, limit=1.0),
    ViscousBetween("hip", "slide", 0.9), FunctionLaw("wheel", lambda t, plant: t * plant.rate("hip") + plant.value("slide")),
)  # fmt: skip


def machine() -> Mechanism:
    """A ball joint, a hinge and a slide with zeros off 0, and a shaft over two of them."""
    b = ml.Builder("machine")
    b.body("ball", spherical("socket"), inertia=Inertia(1.0, (0.1, 0.0, 0.0), (0.1, 0.1, 0.1, 0.0, 0.0, 0.0)))
    b.body("arm", revolute("hip", "y", zero=0.3), parent="ball", inertia=Inertia.point(1.0, (0.2, 0.0, 0.1)))
    b.body("block", prismatic("slide", "x", zero=-0.2), parent="arm", inertia=Inertia.point(0.5))
    b.shaft("wheel", {"hip": 3, "slide": -2}, inertia=1e-3)
    return b.build()


def states(m: Mechanism) -> list[TreePlant]:
    rng = np.random.default_rng(2)
    out = []
    for _ in range(20):
        q = m.reference()
        q[4:] = rng.uniform(-1.0, 1.0, 2)
        out.append(TreePlant(m).set(q, 3.0 * rng.standard_normal(m.nv), float(rng.uniform(-0.1, 1.6))))
    return out


@pytest.mark.parametrize("t", [-0.1, 0.0, 0.2, 0.37, 0.9, 1.0, 1.5, 1.7])
def test_motions_as_linear_forms(t: float) -> None:
    basis = TimeBasis(MOTIONS)
    phi = np.zeros(basis.size)
    basis.values(t, phi)
    for motion in MOTIONS:
        found = [basis.row(motion, gains) @ phi for gains in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        # 1e-11: accelerations of the splines are of size 1e3
        np.testing.assert_allclose(found, motion.at(t), rtol=1e-12, atol=1e-11)


def test_a_spline_as_one_of_many_is_that_of_scipy() -> None:
    spline = next(m for m in MOTIONS if isinstance(m, Spline))
    assert isinstance(spline, Spline)
    truth = make_interp_spline(spline.times, spline.values, k=5)
    basis = TimeBasis(MOTIONS)
    phi = np.zeros(basis.size)
    basis.values(0.71, phi)
    assert basis.row(spline, (1.0, 0.0, 0.0)) @ phi == pytest.approx(float(truth(0.71)), rel=1e-13)
    assert basis.row(spline, (0.0, 0.0, 1.0)) @ phi == pytest.approx(float(truth(0.71, nu=2)), rel=1e-12)


@pytest.mark.parametrize("laws", [*[(law,) for law in LAWS], LAWS, LAWS[:2]], ids=lambda x: x[0].kind if len(x) == 1 else len(x))
def test_forces_are_those_of_the_laws(laws: tuple[Law, ...]) -> None:
    m = machine()
    compiled = CompiledLaws(m, laws)
    for plant in states(m):
        compiled.states.put(plant, compiled.states.initial)
        wanted, by_name = applied_force(m, laws, plant.t, plant)
        compiled.put(plant.t, plant.q, plant.v)
        forces, total = compiled.forces(plant.t, plant)
        np.testing.assert_allclose(total, wanted, rtol=1e-12, atol=1e-12)
        for name, f in zip(compiled.targets, forces, strict=True):
            assert f == pytest.approx(by_name[name], rel=1e-12, abs=1e-12)
        if compiled.affine:
            np.testing.assert_array_equal(compiled.affine_force(), total)


def test_an_engine_may_keep_the_state_in_another_order() -> None:
    m = machine()
    order = StateOrder(np.array([9, 9, 9, 5, 2]), np.array([6, 5, 4, 1, 3]), 10, 7)
    ours, other = CompiledLaws(m, LAWS[:-1]), CompiledLaws(m, LAWS[:-1], order)
    for plant in states(m)[:5]:
        q, v = np.zeros(10), np.zeros(7)
        q[order.coordinates], v[order.rates] = plant.q[m.q_columns], plant.v
        ours.put(plant.t, plant.q, plant.v)
        other.put(plant.t, q, v)
        np.testing.assert_allclose(
            other.forces(plant.t, plant)[1][order.rates], ours.forces(plant.t, plant)[1], rtol=1e-13, atol=1e-13
        )


def test_the_rate_of_a_current_is_that_of_the_law() -> None:
    m = machine()
    laws = (LAWS[9], DcMotor("hip", Sine(2.0, 3.0), 0.1, 1.0, 0.02, 0.3))
    compiled = CompiledLaws(m, laws)
    for plant in states(m)[:5]:
        currents = np.array([0.3, -1.2])
        compiled.put(plant.t, plant.q, plant.v)
        compiled.put_states(currents)
        np.testing.assert_allclose(
            compiled.state_rates(plant.t, plant), compiled.states.rate(plant.t, plant, currents), rtol=1e-12
        )


def test_computed_torque_takes_its_commands_from_the_matrix() -> None:
    design = ml.load("delta6")
    for scene in ("head-tracking", "toolpath"):
        (law,) = design.scene(scene, "minimal").laws
        assert isinstance(law, ComputedTorque)
        m = design.mechanism("minimal")
        compiled = CompiledLaws(m, (law,))
        plant = TreePlant(m, m.reference(), 0.1 * np.arange(m.nv)).set(m.reference(), 0.1 * np.arange(m.nv), 0.43)
        compiled.put(plant.t, plant.q, plant.v)
        wanted = law.force(plant.t, plant)
        np.testing.assert_allclose(
            compiled.forces(plant.t, plant)[0], [wanted[n] for n in compiled.targets], rtol=1e-10, atol=1e-10
        )


def test_a_law_that_is_derived_keeps_its_own_force() -> None:
    @dataclass(frozen=True)
    class Reversed(Viscous):
        def force(self, t: float, plant: Plant) -> Mapping[str, float]:
            return {self.on: self.coefficient * plant.rate(self.on)}

    m = machine()
    compiled = CompiledLaws(m, (Reversed("hip", 0.5),))
    (plant, *_) = states(m)
    compiled.put(plant.t, plant.q, plant.v)
    assert compiled.forces(plant.t, plant)[0][0] == pytest.approx(0.5 * plant.rate("hip"), rel=1e-14)


def test_a_force_on_a_name_that_was_not_declared() -> None:
    class Odd:
        kind = "odd"

        def targets(self) -> tuple[str, ...]:
            return ("hip",)

        def force(self, t: float, plant: Plant) -> Mapping[str, float]:
            return {"hip": 1.0, "slide": 2.0}

    m = machine()
    laws: tuple[Law, ...] = (Odd(), Servo("hip", Hold(0.0), 3.0, 0.0, limit=0.5))
    compiled = CompiledLaws(m, laws)
    for plant in states(m)[:3]:
        compiled.put(plant.t, plant.q, plant.v)
        np.testing.assert_allclose(compiled.forces(plant.t, plant)[1], applied_force(m, laws, plant.t, plant)[0], atol=1e-14)


def test_a_number_that_is_not_finite_is_left_to_the_law() -> None:
    compiled = CompiledLaws(machine(), (Harmonic("hip", math.nan, 1.0),))
    assert not compiled.affine


def test_a_mapping_of_functions_and_numbers() -> None:
    m = machine()
    laws = laws_of({"hip": 2.0, "slide": lambda t, plant: -plant.rate("slide")})
    (plant, *_) = states(m)
    compiled = CompiledLaws(m, laws)
    compiled.put(plant.t, plant.q, plant.v)
    np.testing.assert_allclose(compiled.forces(plant.t, plant)[0], [2.0, -plant.rate("slide")], rtol=1e-14)
