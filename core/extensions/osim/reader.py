"""Documents of OpenSim among the models of links."""

from __future__ import annotations

from ...doors import Offer
from ..trees.reader import TreeReader
from . import EXTENSION

OSIM = TreeReader(
    suffixes=(".osim",),
    tag="OpenSimDocument",
    reads=Offer(EXTENSION, "osim:read_osim"),
    includes=Offer(EXTENSION, "osim:whole_osim"),
)
