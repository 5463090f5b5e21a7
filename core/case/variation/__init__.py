"""Variations of a design: places of its geometry, laws of their variation, and the file format."""
