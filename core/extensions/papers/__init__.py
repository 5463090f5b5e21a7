"""Short papers: a summary of two pages, and the figures of a page as files."""

from ...doors import Extension

EXTENSION = Extension(__name__, needs=["reports"], forms={"papers": "options:Papers"})
