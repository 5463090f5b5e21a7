"""YAML read as plain tables."""

from ...doors import Extension

EXTENSION = Extension(__name__)
