"""Mechanisms of one purpose beside each other: straight lines, quick returns, walking legs, each a page that a teacher can show."""

from mechlab.studies.compare.result import Comparison
from mechlab.studies.compare.study import KINDS, compare, family_of

__all__ = ["KINDS", "Comparison", "compare", "family_of"]
