"""Curves by arc length, beyond lock-ups of a driver."""

from ...doors import Extension

EXTENSION = Extension(__name__, commands={"trace": "command:Trace"})
