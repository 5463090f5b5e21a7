"""The ledger of a reader: the names of a file note which of them it asks for.

A name without a question is dropped in silence, whatever the reader was written to know. At the end
of the reading each such name is in its format's table of names without meaning for kinematics, or
it stops the run.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class Asked(dict[str, str]):
    """Texts by name, which note the names that are asked for; a walk over all of them asks for
    none.

    Attributes:
        asked: the names, whether it has them or not.
    """

    __slots__ = ("asked",)

    def __init__(self, texts: Mapping[str, str], asked: set[str] | None = None) -> None:
        """Take the texts.

        Args:
            asked: names asked for before, of the same place in the file.
        """
        super().__init__(texts)
        self.asked = set[str]() if asked is None else asked

    def __getitem__(self, name: str) -> str:
        self.asked.add(name)
        return super().__getitem__(name)

    def __contains__(self, name: object) -> bool:
        self.asked.add(str(name))
        return super().__contains__(name)

    def get(self, name: str, default: Any = None) -> Any:
        """Return the text of a name, or the default."""
        self.asked.add(name)
        return super().get(name, default)

    @property
    def unasked(self) -> list[str]:
        """The names without a question."""
        return [name for name in self.keys() if name not in self.asked]
