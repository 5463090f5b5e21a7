"""Two designs beside each other: what changes in their outputs."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["measured", "reports"],
    commands={"compare": "command:Compare"},
    public={"compare": "command:Compare"},
)
