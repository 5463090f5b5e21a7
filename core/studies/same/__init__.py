"""Are two files the same mechanism? Each is the other's judge: see `compare`."""

from .links import Match, match_links
from .motion import Placement
from .verdict import Comparison, compare

__all__ = ["Comparison", "Match", "Placement", "compare", "match_links"]
