"""Motions from elsewhere against the native rows: what they leave of them, and the forces that they
need.
"""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    public={"Residuals": "replay:Residuals", "residuals": "replay:residuals"},
)
