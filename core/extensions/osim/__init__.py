"""Models of OpenSim."""

from ...doors import Extension

EXTENSION = Extension(__name__, needs=["trees", "xml"], readers={"osim": "reader:OSIM"})
