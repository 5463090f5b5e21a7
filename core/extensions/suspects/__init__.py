"""Suspicion of a reference or of native, with the slip that explains it."""

from ...doors import Extension

EXTENSION = Extension(__name__, suspicions={"agreement": "suspects:suspect"})
