"""Escaping of foreign text for Markdown: messages come from files and simulators."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ..case.io.escape import visible


def escaped(text: str) -> str:
    """Return text that Markdown shows unchanged on a line or in a cell: without mark-up, links,
    HTML or notified users.
    """
    plain = (
        visible(" ".join(text.split()))
        .replace("&", "&amp;")
        .replace("<", "&lt;")
        .replace(">", "&gt;")
    )
    # an underscore inside a word and brackets without a target are plain text
    plain = re.sub(r"([\\`*~|]|(?<!\w)_|_(?!\w)|(?<=\])\()", r"\\\1", plain)
    return re.sub(r"(?<!\w)@(?=\w)", "@\N{WORD JOINER}", plain)


def code(name: str) -> str:
    """Return a name as code, where only a bar can be escaped."""
    shown = visible(name).replace("`", "'").replace("|", "\\|")
    return f"`{shown}`"


def row(cells: Iterable[str]) -> str:
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"
