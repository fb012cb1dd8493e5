"""A method with the softness of its constraints set by hand: what maps of softness and redundancy turn."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from mechlab.experiment.settings import Settings
from mechlab.experiment.trace import Trace
from mechlab.study.methods import GAINS, Method, Problem
from mechlab.study.witness import room


@dataclass(frozen=True)
class Tuned(Method):
    """time_constant [s] and impedance of MuJoCo's rows (0: as the method has it), `mu` of Pinocchio's (0: as it has it)."""

    time_constant: float = 0.0
    impedance: float = 0.0
    mu: float = 0.0

    def settings(self, value: float) -> Settings:
        """Settings at a step [s], with the softness set by hand."""
        base = Method.settings(self, value)
        if self.time_constant:
            base = replace(base, timeconst=self.time_constant / value)
        if self.impedance:
            base = replace(base, impedance=self.impedance)
        return base

    def run(self, problem: Problem, value: float) -> Trace:
        """The problem at a step [s] that divides the output distance."""
        if self.engine != "pinocchio" or not self.mu:
            return Method.run(self, problem, value)
        room("pinocchio")
        from mechlab.solve.trace import Stabilisation, trace

        gains = Stabilisation(*GAINS[self.constraints], self.mu)
        return trace(problem.mechanism, problem.scene, self.settings(value), problem.outputs, gains)


def tuned(method: Method, time_constant: float = 0.0, impedance: float = 0.0, mu: float = 0.0) -> Tuned:
    """The method with these set; see `Tuned`."""
    kept = {f.name: getattr(method, f.name) for f in fields(Method)}
    return Tuned(**kept, time_constant=time_constant, impedance=impedance, mu=mu)
