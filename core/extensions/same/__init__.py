"""Are two files the same mechanism? Each is the other's judge: see `compare`."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["closing", "free", "residuals", "trees", "xml"],
    commands={"same": "command:Same"},
)
