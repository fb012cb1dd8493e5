"""MuJoCo: Mechanism + Scene + Settings -> Recording, and its own answers to questions by Newton on its kinematics."""
