"""Any MuJoCo model as its file says, whatever it holds: runs of it, and what is wrong, or will go wrong, with it.

Each rule takes a mujoco.MjModel and yields `mechlab.experiment.recording.Symptom`s; `mechlab doctor` puts them together.
"""
