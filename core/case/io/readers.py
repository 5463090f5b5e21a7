"""Readers of files of other programs: which files they claim, their options, and their cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any

from ...doors import offers
from ...errors import KincheckError
from ...options import option, option_fields, positive

if TYPE_CHECKING:
    from pathlib import Path

    from ..case import Case

WITHOUT = "left out by --without: "
"""Begin of the note on what the user leaves out of a model."""
LEFT_OUT = "; left out: "
"""Separator in the source of a case, before the list of omitted content of its file."""

WORKBOOKS = (".xlsx", ".xlsm")
LARGEST_FILE = 4_000_000
"""Of a text with a mechanism [bytes]."""


@dataclass(frozen=True)
class ReaderOptions:
    """Options of a reader, as typed; the reader checks them.

    Attributes:
        recorded: whether a recording is there, whose motion a file without its own follows.
    """

    recorded: bool = field(default=False, kw_only=True)

    @property
    def given(self) -> list[str]:
        """Names of the given options, as on the command line."""
        return [name for name in names_of(type(self)) if getattr(self, name.replace("-", "_"))]


def names_of(options: type[ReaderOptions]) -> list[str]:
    """Return the names of options, as on the command line; those under a heading come first."""
    found = [(each.name, meaning) for each, meaning, _ in option_fields(options)]
    found.sort(key=lambda each: not (each[1] and each[1].heading))
    return [name.replace("_", "-") for name, _ in found]


@dataclass(frozen=True)
class CaseOptions(ReaderOptions):
    """Options of case files, and of files whose numbers are rounded."""

    closure: float | None = option(
        "accept gaps up to X [m] that stem from rounded digits of the file: rows that are"
        " redundant within X are left out; default: [closure] tolerance of a case file, else 0;"
        " for a model, from its digits",
        positive,
        metavar="X",
        kw_only=True,
    )


@dataclass(frozen=True)
class Reader:
    """A reader of files of one kind.

    Attributes:
        kind: what such a file is, for messages.
        options: the options that it takes, a data class.
        suffixes: of files that are all of this kind.
        others: suffixes that such files share with case files or other kinds: the content decides,
            and readers without the suffix are not asked.
        unread: what to do with files that people have beside such files, by suffix.
        leaves_freedoms: whether a recording may drive what is free in such a file.
    """

    kind: str
    options: type[ReaderOptions] = ReaderOptions
    suffixes: Sequence[str] = ()
    others: Sequence[str] = ()
    unread: Mapping[str, str] = field(default_factory=dict[str, str])
    leaves_freedoms: bool = False

    def claims(self, file: Path, text: str, options: Any) -> int:
        """Return how surely a file without such a suffix is of this kind: 0 not, 1 by the
        options or the suffix, 2 by its form, 3 by a word of its format.

        Raises:
            CaseError: the text can be of no other kind, and is broken.
        """
        return 0

    def read(self, file: Path, options: Any) -> Case:
        """Return the case of a file.

        Raises:
            CaseError: the file is unreadable, inconsistent or incomplete.
        """
        raise NotImplementedError


@cache
def readers() -> Sequence[Reader]:
    """Return the readers that extensions offer.

    Raises:
        KincheckError: two of them have the same suffix.
    """
    found: dict[str, Reader] = {name: each.load() for name, each in offers("readers").items()}
    owner: dict[str, str] = {}
    for name, reader in found.items():
        for suffix in reader.suffixes:
            if owner.setdefault(suffix, name) != name:
                raise KincheckError(
                    f"The readers {owner[suffix]} and {name} both read {suffix} files. Uninstall"
                    " the one that you do not use."
                )
    return [*found.values()]


def text_of(file: Path, *, of_spreadsheet: bool = False) -> str:
    """Return the text of a file of points or parts; see `read_text`."""
    from .document import read_text

    return read_text(
        file,
        LARGEST_FILE,
        "hardpoints and mechanisms need far less; take out what is not geometry",
        of_spreadsheet=of_spreadsheet,
    )
