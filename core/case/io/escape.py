"""Escape text from files and simulators for people: control characters become visible, and have no
effect.
"""

from __future__ import annotations


def visible(text: str, also: str = "") -> str:
    r"""Return the text with all unprintable characters as escapes: \x1b, \u202e, \udcff. Spaces and
    letters stay.

    A terminal obeys escape sequences, direction marks change the order of reading, and lone
    surrogates cannot be written.

    Args:
        also: unprintable characters to keep.
    """
    if text.isprintable():
        return text
    return "".join(
        letter
        if letter.isprintable() or letter in also
        else letter.encode("unicode_escape").decode("ascii")
        for letter in text
    )


def file_name(text: str) -> str:
    """Return a file name for any text, even a path; the name leads to no other folder."""
    return "".join(letter if letter.isalnum() or letter in "-_. ()'" else "_" for letter in text)


def cell(value: object) -> object:
    """Return a value for a cell of a CSV file.

    A text gets an apostrophe if a spreadsheet would compute it as a formula.
    """
    if not isinstance(value, str):
        return value
    return (
        f"'{visible(value)}"
        if value.startswith(("=", "+", "-", "@", "\t", "\r"))
        else visible(value)
    )
