"""Designs from their curves: the least change of a table to reach a target, and the table behind
the curves of a rig.
"""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["compare", "compliance", "hardpoints", "measured", "reports", "suspects", "sweep"],
    commands={"tune": "tune_command:Tune", "fit": "fit_command:Fit"},
    proposals={"tune": "proposal:propose"},
    public={"tune": "tune_command:Tune", "fit": "fit_command:Fit"},
)
