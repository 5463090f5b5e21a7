"""Numbers with their derivatives by many parameters."""

from ...doors import Extension

EXTENSION = Extension(__name__)
