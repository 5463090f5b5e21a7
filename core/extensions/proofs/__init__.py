"""Verified samples: exact numbers, ball arithmetic, Krawczyk's test."""

from ...doors import Extension

EXTENSION = Extension(__name__, commands={"reference": "command:ProveReferences"})
