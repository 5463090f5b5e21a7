"""Elements of XML files and of files like them: attributes, texts and lines, for readers."""

from ...doors import Extension

EXTENSION = Extension(__name__)
