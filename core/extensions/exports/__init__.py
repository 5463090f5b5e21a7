"""Mechanisms written in the formats of simulators."""

from ...doors import Extension

EXTENSION = Extension(__name__, commands={"export": "command:Export"})
