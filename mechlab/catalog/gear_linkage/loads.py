"""What the uses of the three-gear four-bar load it with: a sheet or strip with its rollers, and a cutter that acts in the stop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from mechlab.analytic import gear_linkage as closed_form
from mechlab.errors import MechlabError
from mechlab.experiment.laws import Law, Plant, Viscous, register
from mechlab.experiment.laws.formula import Affine, Formula
from mechlab.experiment.laws.protocol import OnOne
from mechlab.lazy_dataclass import dataclass


@register("shear")
@dataclass(frozen=True)
class Shear(OnOne):
    """A cut once a turn: the torque -size sin^2(pi (x - begin) / angle) [N m] for an `angle` [rad] from `begin` on, else 0."""

    on: str
    size: float
    begin: float
    angle: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The torque at the present angle."""
        return {self.on: self.at(plant.value(self.on))}

    def at(self, value: float) -> float:
        """The torque [N m] at an angle [rad]."""
        x = (value - self.begin) % (2.0 * math.pi)
        return -self.size * math.sin(math.pi * x / self.angle) ** 2 if x < self.angle else 0.0

    def formulas(self) -> tuple[Formula, ...]:
        """See `mechlab.experiment.laws.formula`."""
        return (Formula(self.on, (Affine(values=((self.on, 1.0),)),), self.at),)


def load_laws(g: closed_form.GearLinkage, drag: float, cut_torque: float) -> tuple[Law, ...]:
    """Drag on the output [N m s], and the largest torque [N m] of a cutter on the crank while the output stands in its play.

    Raises MechlabError for a cutter where the output has no stop to cut in.
    """
    laws: list[Law] = [Viscous("output_angle", drag)] if drag else []
    if cut_torque:
        report = closed_form.regime(g)
        if report.regime is not closed_form.OutputRegime.REVERSING:
            raise MechlabError(
                f"cut_torque = {cut_torque:g} N m: the output of a crank of {g.crank:g} m never stands, there is no stop to cut in; "
                f"take a crank beyond {closed_form.momentary_crank(g.coupler, g.rocker, g.idler_radius, g.frame):.6g} m."
            )
        laws.append(Shear("crank_angle", cut_torque, report.stop_angle, report.dwell_angle_one_sided))
    return tuple(laws)
