"""Documents of OpenSim among the models of links."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..trees.reader import TreeReader

if TYPE_CHECKING:
    from ..trees.tree import Tree
    from ..xml.element import Element


@dataclass(frozen=True)
class _Document(TreeReader):
    def whole(self, root: Element) -> Element:
        from .osim import whole_osim

        return whole_osim(root)

    def tree(self, root: Element) -> Tree:
        from .osim import read_osim

        return read_osim(root)


OSIM = _Document(suffixes=(".osim",), tag="OpenSimDocument")
