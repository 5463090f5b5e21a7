"""Simbody, through OpenSim's Python package: projection mode with its kinematics and constraints,
and simulate mode with its assembler.
"""

from ...core.doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["floors", "simulate"],
    engines={"simbody": "simbody:Simbody"},
    floors={"simbody": "floors:floor"},
    simulations={"simbody": "assembly:Assembly"},
)
