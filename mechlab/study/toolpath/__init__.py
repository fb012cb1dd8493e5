"""Toolpaths: curves in files, how long they are, and where to brake on them."""

from mechlab.study.toolpath.curve_file import read_curve
from mechlab.study.toolpath.question import NAME, QUESTION, solve_toolpath

__all__ = ["NAME", "QUESTION", "read_curve", "solve_toolpath"]
