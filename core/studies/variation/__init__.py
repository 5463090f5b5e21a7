"""Variations of a design: varied places of its geometry, distributions, and the file format."""
