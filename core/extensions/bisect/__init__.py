"""kincheck bisect: the release of a simulator that changed a result, the term, and who is right."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["exports"],
    commands={"bisect": "command:Bisect"},
    schemas={"bisect": "results:Bisection"},
)
