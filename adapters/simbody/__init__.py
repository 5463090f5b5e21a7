"""Simbody, by OpenSim's Python package: projection by its kinematics and its own constraints."""
