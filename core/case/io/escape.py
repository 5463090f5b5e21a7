"""Text that came from files or simulators, on its way to people: control characters are shown, and
do nothing.
"""

from __future__ import annotations


def visible(text: str, also: str = "") -> str:
    r"""Return the text with all unprintable characters as escapes: \x1b, \u202e, \udcff; spaces and
    letters are kept.

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
    """Return a file name in its own folder from any text, even a path."""
    return "".join(letter if letter.isalnum() or letter in "-_. ()'" else "_" for letter in text)


def cell(value: object) -> object:
    """A value for a cell of a CSV file: a text that a spreadsheet would take for a formula, and
    compute, gets an apostrophe.
    """
    if not isinstance(value, str):
        return value
    return (
        f"'{visible(value)}"
        if value.startswith(("=", "+", "-", "@", "\t", "\r"))
        else visible(value)
    )
