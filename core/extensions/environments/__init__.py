"""Environments of engines that cannot live in kincheck's own."""

from ...doors import Extension

EXTENSION = Extension(__name__)
