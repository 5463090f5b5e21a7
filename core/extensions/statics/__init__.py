"""Statics: equilibria of a mechanism with springs, bushings and loads, and their compliance."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    sections={"equilibrium": "section:SECTION"},
    equilibria={"native": "native_equilibria:equilibria"},
)
