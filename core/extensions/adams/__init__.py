"""Datasets of Adams Solver (.adm), read into cases."""

from ...doors import Extension

EXTENSION = Extension(
    __name__, needs=["closing", "explain", "trees", "xml"], readers={"dataset": "reader:DATASET"}
)
