"""Short papers: a summary of two pages, and the figures of a page as files."""

from ...doors import Extension

EXTENSION = Extension(__name__, forms={"papers": "options:Papers"})
