"""Drake: projection by the kinematics and Jacobians of its MultibodyPlant."""
