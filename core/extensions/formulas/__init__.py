"""Formulas in the notation of Adams: motions of drivers, and functions of forces."""

from ...doors import Extension

EXTENSION = Extension(__name__, motions={"formula": "motion:Formula"})
