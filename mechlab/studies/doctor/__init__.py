"""`mechlab doctor`: what is wrong, or will go wrong, with anybody's MJCF or URDF; and the settings to paste."""

from mechlab.experiment.recording import Symptom
from mechlab.studies.doctor.case import Diagnosis

__all__ = ["Diagnosis", "Symptom"]
