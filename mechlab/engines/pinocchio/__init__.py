"""Pinocchio: Mechanism to pin.Model; assembly and inverse kinematics, Jacobians, constrained dynamics, runner."""
