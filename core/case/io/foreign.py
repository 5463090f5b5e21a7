"""Recognise files of other programs, given in place of a text, by their first bytes. Each kind has
a name and a remedy.
"""

from __future__ import annotations

import codecs
import io
import re
import zipfile
from collections.abc import Sequence
from contextlib import suppress

EXCEL, ARCHIVE = "an Excel workbook", "a zip archive"
_TABLE = "export the table as CSV or .xlsx"
_OFFICE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_ZIP, _MEMBER = b"PK\x03\x04", b"PK\x01\x02"
MOST_MEMBERS = 10_000
"""Of an archive; an office document has some tens."""
_SIGNATURES: Sequence[tuple[bytes, str, str]] = (
    (b"%PDF", "a PDF document", "export the numbers from the program that made it, as CSV"),
    (b"%!PS", "a PostScript document", "export the numbers from the program that made it, as CSV"),
    (b"{\\rtf", "a rich text document", "copy the table into a spreadsheet and save it as CSV"),
    (b"\x89PNG", "a PNG image", "type the numbers into a table"),
    (b"\xff\xd8\xff", "a JPEG image", "type the numbers into a table"),
    (b"GIF8", "a GIF image", "type the numbers into a table"),
    (b"II*\x00", "a TIFF image", "type the numbers into a table"),
    (b"MM\x00*", "a TIFF image", "type the numbers into a table"),
    (b"RIFF", "an image or a sound", "type the numbers into a table"),
    (b"\x1f\x8b", "a gzip archive", "unpack it and give the file inside"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it and give the file inside"),
    (b"Rar!", "a RAR archive", "unpack it and give the file inside"),
    (b"BZh", "a bzip2 archive", "unpack it and give the file inside"),
    (b"\xfd7zXZ", "an xz archive", "unpack it and give the file inside"),
    (b"MATLAB 5.0 MAT-file", "a MATLAB file", "write the table in MATLAB: writetable(T, 'a.csv')"),
    (b"\x89HDF", "an HDF5 file", _TABLE),
    (b"SQLite format 3", "an SQLite database", _TABLE),
    (b"PAR1", "a Parquet file", _TABLE),
    (
        _OFFICE,
        "an Excel file before 2007 (.xls), another old Office file, or one with a password",
        "save it as .xlsx without a password, or as CSV",
    ),
)
# Start of a web page; models in XML have other first elements.
_HTML = re.compile(rb"\s*(?:<!doctype\s+html|<html|<table|<meta)\b", re.IGNORECASE)
_MEMBERS: Sequence[tuple[str, str, str]] = (
    ("xl/workbook.bin", "a binary Excel workbook (.xlsb)", "save it as .xlsx or as CSV"),
    ("xl/", EXCEL, "name it .xlsx, or save the sheet as CSV"),
    ("word/", "a Word document", "copy the table into a spreadsheet and save it as CSV"),
    ("ppt/", "a PowerPoint presentation", "copy the table into a spreadsheet and save it as CSV"),
    ("content.xml", "an OpenDocument file (.ods, .odt)", "save it as .xlsx or as CSV"),
)
"""Start of a name in an archive, its kind and the remedy."""
# Tab, line feed, form feed and carriage return are the only control characters of texts.
_CONTROL = re.compile(rb"[\x00-\x08\x0b\x0e-\x1a\x1c-\x1f]")


def foreign(data: bytes) -> str:
    """Return the kind of a file of another program, and a remedy: "found a PDF document, expected
    text; export ..."; empty if the file may be a text.
    """
    what, advice = recognise_format(data)
    return f"found {what}, expected text; {advice}" if what else ""


def binary(data: bytes) -> bool:
    """Return whether data has control characters; texts have none."""
    return _CONTROL.search(data) is not None


def recognise_format(data: bytes) -> tuple[str, str]:
    """Return the kind of a file and the remedy; two empty texts if it may be a text."""
    if data.startswith(_ZIP):
        return _archive(data)
    for start, what, advice in _SIGNATURES:
        if data.startswith(start):
            return what, advice
    if _HTML.match(data.removeprefix(codecs.BOM_UTF8)):
        return "a web page (HTML)", "open it in a spreadsheet program and save it as CSV or .xlsx"
    return "", ""


def members(data: bytes) -> int:
    """Return how many members an archive lists, at least."""
    return data.count(_MEMBER)


def too_large(data: bytes, most: int) -> str:
    """Return why an archive would take too much memory or room, as an attack would; empty if not.

    Args:
        most: largest size of all members together when unpacked.

    Raises:
        BadZipFile, ValueError, NotImplementedError, OSError, EOFError: it is damaged.
    """
    if (count := members(data)) > MOST_MEMBERS:
        return f"has {count} parts, expected {MOST_MEMBERS} at most"
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        size = sum(each.file_size for each in archive.infolist())
    return f"unpacks to {size} bytes, expected {most} at most" if size > most else ""


def _archive(data: bytes) -> tuple[str, str]:
    """Return the kind of an archive by the names inside it, and the remedy; if damaged, the kind is
    "archive".
    """
    with suppress(zipfile.BadZipFile, ValueError, NotImplementedError, OSError):
        few = members(data) <= MOST_MEMBERS
        names = zipfile.ZipFile(io.BytesIO(data)).namelist() if few else []
        for start, what, advice in _MEMBERS:
            if any(name.startswith(start) for name in names):
                return what, advice
    return ARCHIVE, "unpack it and give the file inside"
