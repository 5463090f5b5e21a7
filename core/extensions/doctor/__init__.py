"""A test of the installation."""

from ...doors import Extension

EXTENSION = Extension(__name__, commands={"doctor": "command:Doctor"})
