"""`mechlab doctor`: what is wrong, or will go wrong, with anybody's MJCF or URDF; and the settings to paste."""

from mechlab.studies.doctor.case import Diagnosis, Symptom

__all__ = ["Diagnosis", "Symptom"]
