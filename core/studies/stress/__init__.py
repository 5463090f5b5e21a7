"""Stress: situations that break kinematic solvers, independent reference
motions, engines' outcomes.
"""
