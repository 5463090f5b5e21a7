"""A page to name unnamed points: in 3D, role by role, with roles proposed by geometry. The
answer is the house's file of names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ...errors import KincheckError
from ..hardpoints.guess import Guess, guess_of
from ..hardpoints.options import WheelOptions
from ..hardpoints.read import case_of_hardpoints
from ..hardpoints.reader import read_hardpoints
from ..hardpoints.roles import names_text
from ..hardpoints.table import axes_of, positions_of, unit_of
from .protocol import NamelessPoint, Names, Role, Saved, Unnamed
from .table import LiveFile


def naming_of(file: Path, supplied: WheelOptions) -> Guess | None:
    """Return the guess of a table whose names do not tell the roles of its points; None of another.

    Raises:
        CaseError: the file cannot be read.
    """
    guess = guess_of(read_hardpoints(file, supplied), supplied, case_of_hardpoints)
    return guess if guess and "names" in guess.stated else None


class LiveNaming(LiveFile):
    """A table whose points have no roles yet.

    Args:
        named: takes the guess and the file of names when it is written.
    """

    kind, page = "table without roles", "naming"

    def __init__(self, guess: Guess, named: Callable[[Guess, Path], None]) -> None:
        self.guess, self.named, self.file = guess, named, guess.table.file

    def opening(self, engines: Sequence[str]) -> Unnamed:
        """Return the points in metres, x forward, y left, z up; roles with their proposed point;
        and pairs of roles with a link between.
        """
        guess, table, taken = self.guess, self.guess.table, self.guess.taken
        template = guess.fit.template
        places = positions_of(table, unit_of(table, taken.units), axes_of(table, taken.axes))
        needed = [role.name for role in template.roles]
        links = [row[3:5] for row in template.joint_rows.values() if len(row) == 5]
        links += [
            (role, role.replace(end, "_outer")) for role in needed for end in ("_front", "_rear")
        ]
        return Unnamed(
            file=table.file.name,
            template=template.name,
            why=[*guess.why],
            doubts=[*guess.doubts],
            points=[NamelessPoint(name, [*at]) for name, at in places.items()],
            roles=[
                Role(
                    role.name, role.meaning, role.name in needed, guess.fit.roles.get(role.name, "")
                )
                for role in (*template.roles, *template.optional)
            ],
            links=[(a, b) for a, b in links if a != b],
        )

    def names(self, asked: Names) -> Saved:
        """Write the file of names; see `save_names`."""
        file = save_names(self.guess, asked.roles)
        self.named(self.guess, file)
        return Saved(name=str(file))


def save_names(guess: Guess, roles: Mapping[str, str]) -> Path:
    """Write the file of names, if the case of these roles can be made.

    Raises:
        KincheckError: a role or point is unknown, a needed role is missing, a point has two roles,
            the case cannot be made, or the file cannot be written.
    """
    template = guess.fit.template
    known = {role.name for role in (*template.roles, *template.optional)}
    filled = {role: name for role, name in roles.items() if name}
    if unknown := [*({*filled} - known), *({*filled.values()} - guess.table.points.keys())]:
        raise KincheckError(f"There is no role or point {unknown[0]!r}.")
    if missing := [role for role in template.roles if role.name not in filled]:
        raise KincheckError(f"Choose a point for {missing[0].name}: {missing[0].meaning}.")
    case_of_hardpoints(replace(guess.table, roles=filled), guess.taken)
    (file,) = guess.writes
    try:
        file.write_text(names_text(template, filled), encoding="utf-8")
    except OSError as error:
        raise KincheckError(
            f"{file} cannot be written ({error.strerror}). Start kincheck where it can."
        ) from None
    return file
