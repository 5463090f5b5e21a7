"""Reader of a user's own names of hardpoints: TOML or JSON, `role = "own name"`, with the
template's roles.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from ...io.document import fault, parse, read_text, shown, unknown_name

LARGEST_NAMES = 100_000


def read_own_names(file: Path, roles: Iterable[str], points: Iterable[str]) -> Mapping[str, str]:
    """Return the names of points by role, for the roles in the file.

    Args:
        roles: roles of the template.
        points: names of the points of the table.

    Raises:
        CaseError: the file cannot be read, or a role or point is unknown.
    """
    text = read_text(file, LARGEST_NAMES, "it holds a name for each role of a template")
    known, found = [*points], dict[str, str]()
    for role, name in parse(file, text).items():
        if role not in roles:
            raise unknown_name(file, role, role, roles, "a role")
        if not isinstance(name, str):
            raise fault(
                file, role, f"found {shown(name)}, expected the name of a point; write it in quotes"
            )
        if name not in known:
            raise unknown_name(file, role, name, known, "a point of the table")
        found[role] = name
    return found
