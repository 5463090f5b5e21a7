"""Models in USD."""

from ...doors import Extension

EXTENSION = Extension(__name__, needs=["trees", "xml"], readers={"usd": "reader:STAGE"})
