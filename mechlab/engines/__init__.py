"""Engines that run a mechanism: Pinocchio, MuJoCo, the lab's own, and other people's."""
