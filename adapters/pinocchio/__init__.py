"""Pinocchio: projection by its kinematics and Jacobians, and its constrained dynamics."""
