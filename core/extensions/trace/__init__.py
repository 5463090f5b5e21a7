"""Curves by arc length, beyond lock-ups of a driver."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    commands={"trace": "command:Trace"},
    public={"Curve": "curve:Curve", "Event": "curve:Event", "trace": "curve:trace"},
)
