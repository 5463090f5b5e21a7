"""Exudyn: projection mode with its constraint rows, and simulate mode with its own solvers."""
