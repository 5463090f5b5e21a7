"""What runs programs: a block of lanes that programs read and write in place, and the loop of Newton's iteration over them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..trajectory import Array
from .trace import Program


@dataclass(frozen=True)
class Plan:
    """The programs of a model and what an attempt at its samples is made of.

    An attempt runs `predict`, then `newton` until the slot `residual` of every lane is below the tolerance or not finite, then the
    programs in `after`. It leaves in the slots `iterations` and `done` how often each lane was iterated and whether it got there.

    Attributes:
        programs: by name; they share one layout of slots.
        slots: place of every scalar in a lane, by name.
        after: names of the programs that end an attempt.
        tolerance: of the residual before an iteration; that iteration is the last.
        most: iterations at most.
    """

    programs: Mapping[str, Program]
    slots: Mapping[str, int]
    after: Sequence[str]
    tolerance: float
    most: int


class Executor(Protocol):
    """A plan bound to a block of lanes, shape (slots, lanes)."""

    @property
    def block(self) -> Array: ...

    def run(self, name: str) -> None:
        """Run one program over all lanes. Lanes that divide by zero hold inf or nan afterwards; nothing is raised."""
        ...

    def attempt(self, lanes: int) -> None:
        """Make an attempt at the first lanes."""
        ...
