"""Row styles: forms of the equations with the same solutions, all of them by the same solver.

The kernel has two. Extensions offer others: `Extension.styles`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from ...doors import offers
from ...errors import SolveError
from ...mechanism.mechanism import Mechanism
from ...primitives.base import Drive
from .cartesian import Cartesian
from .constraints import Frames

NATIVE, MIXED = "native", "mixed"
"""Simplified rows in global axes; the same with joint coordinates as further unknowns."""


def styles() -> list[str]:
    """Return the names of all row styles."""
    return [NATIVE, MIXED, *offers("styles")]


def require_style(style: str) -> str:
    """Return the name of a row style.

    Raises:
        SolveError: there is no such style.
    """
    if style not in (NATIVE, MIXED) and style not in offers("styles"):
        raise SolveError(f"there is no style {style!r}; known: {', '.join(styles())}")
    return style


def formulate(
    mechanism: Mechanism,
    frame: Frames,
    style: str = NATIVE,
    drives: Mapping[str, Drive] | None = None,
    named: Collection[str] = (),
) -> Cartesian:
    """Return the equations of a mechanism in a row style; see `Cartesian.of`."""
    if style in (NATIVE, MIXED):
        return Cartesian.of(mechanism, frame, drives, named, mixed=style == MIXED)
    return offers("styles")[style].load()(mechanism, frame, drives or {}, named)
