"""Regression: what changed between two runs, since when, and whether it is worse."""
