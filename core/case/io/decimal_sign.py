"""The decimal sign of a table of numbers: a point or a comma, by the country of the spreadsheet.

A comma before three digits may also group thousands. So may a point if semicolons or tabs separate
the fields. Other numbers of the table then decide; if none decides, the table is refused.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from .document import fault, shown

_SIGNS = re.compile(r"[.,]")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
_ANY = ".,"


def find_decimal_sign(file: Path, cells: Sequence[tuple[str, str]], possible: str = _ANY) -> str:
    """Return the decimal sign of a table: "." or ",".

    Args:
        cells: place and text of each number.
        possible: signs able to group thousands in this table.

    Raises:
        CaseError: the numbers have both signs, group thousands, or leave the sign open.
    """
    first: dict[str, tuple[str, str]] = {}
    open_cell: tuple[str, str] | None = None
    decided, plain = False, False
    for where, text in cells:
        signs = _SIGNS.findall(text)
        if len(signs) > 1:
            raise fault(
                file,
                where,
                f"found {shown(text)}, expected one decimal sign; remove the separators of"
                " thousands",
            )
        if not signs:
            plain = True
            continue
        first.setdefault(signs[0], (where, text))
        if signs[0] in possible and _GROUPED.fullmatch(text):
            open_cell = open_cell or (where, text)
        else:
            decided = True
    if len(first) > 1:
        (_, other), (where, text) = first.values()
        raise fault(
            file,
            where,
            f"found {shown(text)}, and {shown(other)} above, expected one decimal sign in the"
            " table; write all numbers alike",
        )
    # If every number has three decimals, the size decides: read as thousands, the numbers are a
    # thousand times as large, too large for any suspension.
    if open_cell and plain and not decided:
        where, text = open_cell
        digits = _SIGNS.sub("", text)
        raise fault(
            file,
            where,
            f"found {shown(text)}, which is {_SIGNS.sub('.', text)} or {digits}, expected one"
            f" meaning; write {_SIGNS.sub('.', text)}0 or {digits}",
        )
    return next(iter(first), ".")
