"""Datasets of Adams Solver (.adm), read into cases."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["closing", "explain", "formulas", "trees", "xml"],
    readers={"dataset": "reader:DATASET"},
)
