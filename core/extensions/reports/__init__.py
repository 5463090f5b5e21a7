"""Reports of commands, printed and written as files."""

from ...doors import Extension

EXTENSION = Extension(__name__)
