"""Exudyn: projection mode with its constraint rows."""
