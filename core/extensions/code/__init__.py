"""A solved case as code: its programs as C, as JavaScript, and as an FMU with C inside."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["designs", "exports", "sweep"],
    codes={"c": "c:files", "js": "js:files", "fmu": "fmu:files"},
)
