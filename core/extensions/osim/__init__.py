"""Models of OpenSim."""

from ...doors import Extension

EXTENSION = Extension(__name__, needs=("trees",), readers={"osim": "reader:OSIM"})
