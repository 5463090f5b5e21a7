"""Stages of USD among the models of links."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..trees.reader import TreeReader

if TYPE_CHECKING:
    from ..trees.tree import Tree
    from ..xml.element import Element


@dataclass(frozen=True)
class _Stage(TreeReader):
    def root(self, file: Path) -> Element:
        from .usd_stage import root_of_usd

        return root_of_usd(file)

    def tree(self, root: Element) -> Tree:
        from .usd import read_usd

        return read_usd(root)


STAGE = _Stage(suffixes=(".usd", ".usda", ".usdc", ".usdz"), tag="usd")
