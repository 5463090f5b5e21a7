"""Models as simulators save them: each converter loads a file and returns the text saved of it."""

from ...core.doors import Extension

EXTENSION = Extension(__name__, converters={"mujoco": "mujoco:convert"})
