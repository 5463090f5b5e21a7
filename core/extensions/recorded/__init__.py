"""Recordings of other programs as engines: their files, their meaning, and their verdict."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["residuals", "suspects", "xml"],
    sources={"recordings": "source:Recordings", "program": "source:Program"},
)
