"""Error control: a scene solved to a stated error, by one rule set for all mechanisms.

`solve_to` chooses the method and its sharpness, estimates the error by refining, and lets another method check it;
`control` makes a Recording of it.
"""

from mechlab.study.error_control.control import Controlled, control
from mechlab.study.error_control.result import Result
from mechlab.study.error_control.solve import solve_to

__all__ = ["Controlled", "Result", "control", "solve_to"]
