"""Dry friction integrated as it is: set-valued at standstill, with located events, without chatter or smoothing.

Each friction element i acts along a scalar rate r_i = rates[i] @ y with a force in [-limit_i, +limit_i]. Its mode is +1
or -1 (sliding that way, force -mode limit) or 0 (stuck: the force is whatever keeps the rate at zero). Between events the
equations are smooth and DOP853 (Hairer, Norsett & Wanner 1993) integrates them; events are found on its dense output.
At standstill the next modes follow from the force that sticking needs: within its limit an element sticks,
otherwise it slides against that force (Coulomb; Acary & Brogliato 2008, chapter 1). A restart keeps the sliding sense as
its mode and waits for the rate to take that sign, so that an event cannot trigger itself again.
"""

from mechlab.integrate.hybrid.loop import integrate_hybrid
from mechlab.integrate.hybrid.problem import Ending, Event, HybridTrajectory, Modes, RoughProblem, modes_at

__all__ = ["Ending", "Event", "HybridTrajectory", "Modes", "RoughProblem", "integrate_hybrid", "modes_at"]
