"""Stages of USD among the models of links."""

from __future__ import annotations

from ...doors import Offer
from ..trees.reader import TreeReader
from . import EXTENSION

STAGE = TreeReader(
    suffixes=(".usd", ".usda", ".usdc", ".usdz"),
    tag="usd",
    reads=Offer(EXTENSION, "usd:read_usd"),
    opens=Offer(EXTENSION, "usd_stage:root_of_usd"),
)
