"""Datasets of Adams Solver (.adm)."""

from ...doors import Extension

EXTENSION = Extension(
    "kincheck.core.case.models.adams",
    needs=("trees",),
    readers={"dataset": "reader:DATASET"},
)
