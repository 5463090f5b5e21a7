"""Regression: changes between two runs, their first run, and whether they are for the worse."""
