"""YAML read as plain tables."""

from ...doors import Extension

EXTENSION = Extension(__name__, lines={".yaml": "reading:keys_of", ".yml": "reading:keys_of"})
