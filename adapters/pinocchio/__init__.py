"""Pinocchio: projection mode with its kinematics and Jacobians."""
