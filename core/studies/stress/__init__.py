"""Stress: situations that break kinematic solvers, an independent truth for each, and what engines
make of them.
"""
