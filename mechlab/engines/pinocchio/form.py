"""A mechanism as Pinocchio's users take it: the model of the tree, its closures as far as Pinocchio has them, and the rest as rows.

    form = ml.load("fourbar").to_pinocchio()
    model, constraints = form                                     # as a pair
    q, v = form.engine_state(values, rates)                       # names and physical values -> Pinocchio's q, v
    J, bias = form.rows(q, v)                                     # J a + bias = 0 on the closed mechanism

Pinocchio's constraintDynamics takes point and frame closures (RigidConstraintModel):

    spherical   one CONTACT_3D                 exactly its three rows
    fixed       one CONTACT_6D                 exactly its six rows
    revolute    two CONTACT_3D on the axis     six rows for five: one repeats the others

It has no rows for other loops, gears and belts: those stand in `rows_only`, with the reason, and in `rows`. Loops in a plane repeat rows
too, so a ProximalSettings with mu > 0 is needed: pin.ProximalSettings(1e-12, 1e-8, 20) (with mu = 0 Pinocchio answers NaN).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.dynamics import PinPlant
from mechlab.engines.pinocchio.model import PinModel, build
from mechlab.errors import unknown
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.named_state import Named, named_rates, named_values, numbers_of, state_of
from mechlab.mechanism.parts import Joint, Loop, Shaft


class PinocchioForm:
    """See the module. It unpacks as (model, constraints): pin.Model of the tree, ConstraintSet of what closes and couples it.

    The model is the caller's own. Coordinates q (nq,) are Pinocchio's, quaternions (x, y, z, w); rates v (nv,) are in the order of the
    Mechanism, which is Pinocchio's.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self._made: PinModel = build(mechanism)
        self.model: pin.Model = self._made.model
        self.constraints = ConstraintSet(mechanism)

    def __iter__(self) -> Iterator[Any]:
        return iter((self.model, self.constraints))

    def __len__(self) -> int:
        return 2

    def __getitem__(self, k: int) -> Any:
        return (self.model, self.constraints)[k]

    # -- closures ------------------------------------------------------------------------------------------------------

    @cached_property
    def _closures(self) -> list[tuple[str, pin.RigidConstraintModel]]:
        out = []
        for loop in self.mechanism.loops:
            out += [(loop.name, made) for made in rigid_constraints(self._made, loop)]
        return out

    @property
    def rigid_constraints(self) -> pin.StdVec_RigidConstraintModel:
        """Closures that pin.initConstraintDynamics takes, in the order of the loops; without Baumgarte gains."""
        out = pin.StdVec_RigidConstraintModel()
        for _, made in self._closures:
            out.append(made)
        return out

    @property
    def rigid_names(self) -> tuple[str, ...]:
        """The loop of each of `rigid_constraints`; a revolute one stands twice."""
        return tuple(name for name, _ in self._closures)

    @property
    def rows_only(self) -> dict[str, str]:
        """Loop or relation that no RigidConstraintModel can say -> the reason; `rows` has them."""
        told = set(self.rigid_names)
        out = {
            x.name: f"a loop of kind {x.kind} is no point and no frame"
            for x in self.mechanism.loops
            if x.name not in told
        }
        return out | {r.name: "Pinocchio has no constraint that couples joints" for r in self.mechanism.couplings}

    @property
    def not_in_model(self) -> tuple[str, ...]:
        """What acts in the mechanism and not in pin.aba or pin.constraintDynamics of the model; `mass_matrix` and `bias` have it,
        but for dry friction, which has no value at rest."""
        m = self.mechanism
        parts: list[Joint | Shaft] = [*m.joints, *m.shafts]
        found = {
            "inertia of shafts": [s.name for s in m.shafts if s.inertia],
            "damping": [x.name for x in parts if x.damping],
            "stiffness": [x.name for x in parts if x.stiffness],
            "springs": [s.name for s in m.springs],
            "dry friction": [x.name for x in parts if x.friction],
        }
        return tuple(f"{what}: {', '.join(names)}" for what, names in found.items() if names)

    # -- at a state ----------------------------------------------------------------------------------------------------

    @cached_property
    def _plant(self) -> PinPlant:
        return PinPlant(self.mechanism)

    def _at(self, q: ArrayLike, v: ArrayLike | None = None) -> PinPlant:
        rates = np.zeros(self.mechanism.nv) if v is None else np.asarray(v, dtype=float)
        return self._plant.set(self._made.from_pin(np.asarray(q, dtype=float)), rates)

    def rows(self, q: ArrayLike, v: ArrayLike, of: Iterable[str] | None = None) -> tuple[Array, Array]:
        """J (rows, nv) and bias (rows,) = dJ/dt v of loops and relations: all of them, or those named in `of`, such as `rows_only`.

        Raises MechlabError, listing them, for a name that is neither.
        """
        plant = self._at(q, v)
        chosen = self._chosen(of)
        return plant.jacobian()[chosen], plant.constraint_bias()[chosen]

    def residual(self, q: ArrayLike, of: Iterable[str] | None = None) -> Array:
        """(rows,) how far the rows are open [m or rad]."""
        return self._at(q).residual()[self._chosen(of)]

    def row_names(self, of: Iterable[str] | None = None) -> tuple[str, ...]:
        """Names of the rows."""
        return tuple(self.constraints.rows[k] for k in self._chosen(of))

    def _chosen(self, of: Iterable[str] | None) -> list[int]:
        slices = self.constraints.slices
        out: list[int] = []
        for name in slices if of is None else of:
            if name not in slices:
                raise unknown(f"{self.mechanism.name}: loop or relation", name, slices)
            out += range(slices[name].start, slices[name].stop)
        return out

    def mass_matrix(self, q: ArrayLike) -> Array:
        """(nv, nv) M with armatures and shafts."""
        return self._at(q).mass_matrix().copy()

    def bias(self, q: ArrayLike, v: ArrayLike) -> Array:
        """(nv,) h of M a + h = tau + J^T reactions: velocity terms, weight, dampers and springs."""
        return self._at(q, v).bias().copy()

    # -- coordinates ---------------------------------------------------------------------------------------------------

    def engine_state(self, values: Named | ArrayLike, rates: Named | ArrayLike | None = None) -> tuple[Array, Array]:
        """Pinocchio's q (nq,) and v (nv,) for physical values and rates of all joints by name, or for the coordinates and rates of the
        Mechanism as arrays; rates default to 0. Raises MechlabError that names what is missing."""
        q, v = state_of(self.mechanism, values, rates)
        return self._made.to_pin(q), v

    def named_state(
        self, q: ArrayLike, v: ArrayLike | None = None
    ) -> tuple[dict[str, float | Array], dict[str, float | Array]]:
        """Physical values and rates of all joints and shafts by name for Pinocchio's q and v: the inverse of `engine_state`."""
        m = self.mechanism
        own = self._made.from_pin(numbers_of(m, q, self.model.nq, "Pinocchio's q"))
        return named_values(m, own), named_rates(m, np.zeros(m.nv) if v is None else numbers_of(m, v, m.nv, "Pinocchio's v"))


def rigid_constraints(made: PinModel, loop: Loop) -> list[pin.RigidConstraintModel]:
    """The closures of a loop; empty for a kind that Pinocchio does not have."""
    if loop.kind not in ("spherical", "fixed", "revolute"):
        return []
    places = []
    for body, placement in ((loop.body_a, loop.placement_a), (loop.body_b, loop.placement_b)):
        rotation, shift = made.offset_of[body]
        places.append(pin.SE3(rotation, shift) * pin.SE3(placement.rotation, placement.translation))
    kind = pin.ContactType.CONTACT_6D if loop.kind == "fixed" else pin.ContactType.CONTACT_3D
    along = [0.0] if loop.kind != "revolute" else [-0.5 * _size(made), 0.5 * _size(made)]
    out = []
    for z in along:
        moved = pin.SE3(np.eye(3), np.array([0.0, 0.0, z]))
        out.append(
            pin.RigidConstraintModel(
                kind, made.model, made.joint_of[loop.body_a], places[0] * moved, made.joint_of[loop.body_b],
                places[1] * moved, pin.ReferenceFrame.LOCAL,
            )
        )  # fmt: skip
    return out


def _size(made: PinModel) -> float:
    """A length of the mechanism: the largest distance between a body and its parent."""
    return max([float(np.linalg.norm(b.placement.translation)) for b in made.mechanism.bodies] + [1e-3])
