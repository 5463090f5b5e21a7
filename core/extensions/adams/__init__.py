"""Datasets of Adams Solver (.adm), read into cases."""

from ...doors import Extension

EXTENSION = Extension(
    __name__, needs=["closing", "explain", "trees"], readers={"dataset": "reader:DATASET"}
)
