"""A test of the installation."""

from ...doors import Extension

EXTENSION = Extension(__name__, needs=["environments"], commands={"doctor": "command:Doctor"})
