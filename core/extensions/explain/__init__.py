"""Diagnosis of a case: why it cannot be solved, or how well conditioned it is."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["closing", "designs", "slopes", "sweep"],
    commands={"explain": "command:Explain"},
    public={"explain": "command:Explain"},
)
