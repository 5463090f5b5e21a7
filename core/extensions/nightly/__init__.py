"""kincheck nightly: a workflow for the repository of a simulator, and its comment."""

from ...doors import Extension

EXTENSION = Extension(__name__, commands={"nightly": "command:Nightly"})
