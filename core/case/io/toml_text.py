"""Values as text in TOML."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, cast

from ...errors import LONGEST_NAME, CaseError, brief
from .document import SMALLEST


def toml_table(values: Mapping[str, Any], *path: str) -> list[str]:
    """Return the lines of a table of a TOML file, with a heading if it has a path.

    Raises:
        CaseError: a name of the path is not one that a file can hold.
    """
    heading = ["", f"[{'.'.join(map(_toml_key, path))}]"] if path else []
    return [*heading, *(f"{key} = {_toml_value(value)}" for key, value in values.items())]


def _toml_key(name: str) -> str:
    """Return a name as a key, without quotes if TOML allows it."""
    if not (name and name.isprintable() and len(name) <= LONGEST_NAME):
        raise CaseError(
            f"name {brief(name)!r}: found {len(name)} characters, expected 1 to {LONGEST_NAME}"
            " printable ones, which a case file can hold; rename it"
        )
    bare = name.replace("_", "a").replace("-", "a").isalnum() and name.isascii()
    return name if bare else json.dumps(name)


def _toml_value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # a JSON string is a basic string of TOML
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_toml_value, cast('Sequence[Any]', value)))}]"
    if isinstance(value, int):
        return repr(value)
    # the reader refuses smaller numbers; they are the round-off of zeros
    return repr(float(value) if abs(value) >= SMALLEST else 0.0)
