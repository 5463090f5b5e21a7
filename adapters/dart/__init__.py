"""DART: projection by the kinematics and Jacobians of its Skeleton."""
