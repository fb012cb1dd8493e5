"""MuJoCo: Mechanism + Scene + Settings -> Recording, and its own answers to questions by Newton on its kinematics."""

from mechlab.engines.mujoco.model import MujocoMap, equality_jacobian, to_mujoco
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.mujoco.runner import run
from mechlab.engines.mujoco.solve_newton import accelerations_of, assemble, frame_motion, rates

__all__ = [
    "MujocoMap",
    "MujocoPlant",
    "accelerations_of",
    "assemble",
    "equality_jacobian",
    "frame_motion",
    "rates",
    "run",
    "to_mujoco",
]
