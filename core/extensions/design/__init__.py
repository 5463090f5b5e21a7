"""Designs from their curves: the least change of a table that reaches a target, and the table that
a rig measured.
"""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["compare", "hardpoints", "sweep"],
    commands={"tune": "tune_command:Tune", "fit": "fit_command:Fit"},
)
