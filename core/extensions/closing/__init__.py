"""Loops that close to the digits of a file: rows redundant within these are left out."""

from ...doors import Extension

EXTENSION = Extension(__name__, closings={"digits": "digits:within_digits"})
