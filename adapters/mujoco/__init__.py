"""MuJoCo: projection by its kinematics and Jacobians, and its own time stepping."""
