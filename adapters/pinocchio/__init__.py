"""Pinocchio: projection mode with its kinematics and Jacobians, and simulate mode with its
constrained dynamics.
"""
