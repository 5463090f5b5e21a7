"""The ledger of a reader: names in a file note that they are asked for.

What no reader asked for is dropped, whatever the reader was written to know. So at the end of the
reading each such name is one that means nothing for kinematics, in a table of its format, or it
stops the run.
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
        """The names that nobody has asked for."""
        return [name for name in self.keys() if name not in self.asked]
