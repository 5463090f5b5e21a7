"""kincheck site: one static page over the results in a folder."""

from ...doors import Extension

EXTENSION = Extension(
    __name__, needs=["bisect", "board", "reports"], commands={"site": "command:BuildSite"}
)
