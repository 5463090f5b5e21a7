"""Measured curves as references of cases."""

from ...doors import Extension

EXTENSION = Extension(__name__, references={"curve": "reference_curve:with_curve"})
