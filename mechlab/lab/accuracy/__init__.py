"""Error control: a scene solved to a stated error, by one rule set for all mechanisms.

`solve_to` chooses the method and its sharpness, estimates the error by refining, and lets another method check it;
`control` makes a Recording of it.
"""

from mechlab.lab.accuracy.control import Controlled, control
from mechlab.lab.accuracy.result import Result
from mechlab.lab.accuracy.solve import solve_to

__all__ = ["Controlled", "Result", "control", "solve_to"]
