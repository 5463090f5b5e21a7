"""Kinematics and compliance of a suspension: its equilibria over travel and over loads."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["hardpoints", "statics"],
    sections={"compliance": "section:SECTION"},
    commands={"kc": "command:MeasureCompliance"},
    public={"compliance": "command:compliance"},
)
