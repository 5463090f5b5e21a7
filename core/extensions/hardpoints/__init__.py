"""Suspensions by their hardpoints: tables, trees, files of other programs."""

from ...doors import Extension

EXTENSION = Extension(
    "kincheck.core.case.models.hardpoints",
    readers={
        name.lower(): f"reader:{name}"
        for name in ("CHRONO", "ADAMS", "ASSETTO", "TABLE", "TREE", "WORKBOOK")
    },
)
