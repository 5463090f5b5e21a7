"""Drake: projection mode with the kinematics and Jacobians of its MultibodyPlant, and simulate
mode.
"""
