"""Equilibria by the simulators: their kinematics and rows, and Exudyn's own static solver."""

from ...core.doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["simulate", "statics"],
    simulations={"exudyn-static": "exudyn_statics:static"},
    equilibria={"projection": "walk:of_engine"},
)
