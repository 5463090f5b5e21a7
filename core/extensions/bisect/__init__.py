"""kincheck bisect: the release behind a changed result, the changed term, and the right side."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["environments", "exports", "reports"],
    commands={"bisect": "command:Bisect"},
    schemas={"bisect": "results:Bisection"},
)
