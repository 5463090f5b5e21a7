"""Exudyn: projection by its constraint rows, and its own solvers."""
