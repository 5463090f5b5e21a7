"""Drake: projection mode with the kinematics and Jacobians of its MultibodyPlant, and simulate
mode.
"""

from ...core.doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["simulate"],
    engines={"drake": "drake:Drake"},
    simulations={"drake": "drake:Steps"},
)
