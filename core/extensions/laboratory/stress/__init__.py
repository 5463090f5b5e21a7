"""Stress test: situations that break kinematic solvers, independent reference motions, and the
outcomes of engines.
"""
