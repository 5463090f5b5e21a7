"""Simbody, through OpenSim's Python package: projection mode with its kinematics and constraints,
and simulate mode with its assembler.
"""

from ...core.doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["simulate"],
    engines={"simbody": "simbody:Simbody"},
    simulations={"simbody": "assembly:Assembly"},
)
