"""Synthesis: tasks that find dimensions for wanted properties. Each is a function from key=value to a SynthesisResult."""

from mechlab.studies.synthesis.result import SynthesisResult
from mechlab.studies.synthesis.tasks import TASKS, synthesize

__all__ = ["TASKS", "SynthesisResult", "synthesize"]
