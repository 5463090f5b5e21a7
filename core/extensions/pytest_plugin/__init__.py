"""The pytest plugin. Its door is pytest's: the entry point in `pyproject.toml`."""

from ...doors import Extension

EXTENSION = Extension(__name__)
