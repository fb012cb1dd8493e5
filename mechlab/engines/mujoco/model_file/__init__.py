"""Any MuJoCo model file: runs with the settings of the file, and what is wrong with it or will go wrong in a run.

Each rule takes a mujoco.MjModel and yields `mechlab.experiment.recording.Symptom`s; `mechlab doctor` puts them together.
"""
