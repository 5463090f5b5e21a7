"""DART: projection mode with the kinematics and Jacobians of its Skeleton, and simulate mode."""
