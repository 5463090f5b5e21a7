"""Reports of commands, printed and written as files, and their figures as SVG."""

from ...doors import Extension

EXTENSION = Extension(__name__)
