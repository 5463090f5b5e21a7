"""Choice of the reader of a file, by its suffix and content."""

from __future__ import annotations

import re
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

from ...errors import with_article
from ..case import Case
from ..io.document import fault
from ..io.reader_options import NOTHING
from ..io.readers import CaseOptions, Reader, names_of, readers, text_of

_OF_CASE = re.compile(r"^\s*(?:schema\s*=|\[+\s*(?:bodies|joints|drivers|sweep)\b)", re.MULTILINE)


@dataclass(frozen=True)
class _CaseReader(Reader):
    def read(self, file: Path, options: CaseOptions) -> Case:
        from ..io.case_file import load_case

        return load_case(file, options.closure)


CASE = _CaseReader("case file", CaseOptions, (".toml", ".json"))


def load(file: Path, supplied: Any = NOTHING) -> Case:
    """Read a case from a file of any supported kind.

    Args:
        supplied: options of readers, all or those of its own.

    Raises:
        CaseError: the file is unreadable, inconsistent or incomplete, or an option is not for such
            files.
    """
    for ending in ("".join(file.suffixes[-2:]), file.suffix):
        for reader in readers():
            if advice := reader.unread.get(ending.lower()):
                raise fault(file, "", f"found a {ending} file, which {advice}")
    reader = reader_of(file, supplied)
    taken = names_of(reader.options)
    for option in supplied.given:
        if option not in taken:
            known = ", ".join(f"--{name}" for name in taken) or "no such option"
            raise fault(
                file,
                f"--{option}",
                f"found for {with_article(reader.kind)}, which takes {known}; leave it out, or name"
                " this file by itself",
            )
    if reader is not CASE and not file.stem.isprintable():  # it becomes the name of the case
        raise fault(
            file,
            "",
            "found a file name with control characters, expected printable ones; rename the file",
        )
    return reader.read(file, supplied)


def suffixes() -> set[str]:
    """Return the suffixes of names that are files, whether they exist or not."""
    return {
        suffix
        for each in (CASE, *readers())
        for suffix in (*each.suffixes, *each.unread, *each.others)
    }


def reader_of(file: Path, supplied: Any = NOTHING) -> Reader:
    """Return the reader of a file; an unknown kind is a case file, whose reader states its needs.

    Raises:
        CaseError: a file whose content decides cannot be read.
    """
    suffix = file.suffix.lower()
    for reader in readers():
        if suffix in reader.suffixes:
            return reader
    text = text_of(file, of_spreadsheet=suffix not in CASE.suffixes)
    if suffix == ".toml" and _OF_CASE.search(text):
        return CASE
    asked = [each for each in readers() if suffix in each.others] or readers()
    claims = [(reader.claims(file, text, supplied), reader) for reader in asked]
    return max(((0, CASE), *claims), key=itemgetter(0))[1]
