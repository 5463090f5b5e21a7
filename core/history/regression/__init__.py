"""Regression: changes between two runs, their first runs, and whether they are for the worse."""
