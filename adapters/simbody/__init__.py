"""Simbody, through OpenSim's Python package: projection mode with its kinematics and constraints,
and simulate mode with its assembler.
"""
