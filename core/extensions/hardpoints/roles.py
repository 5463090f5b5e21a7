"""Roles of points: the template of a table, and which point fills which role by its name."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from ...case.io.document import fault, parse, read_text, require_known, shown, unknown_name
from ...case.io.escape import visible
from ...errors import MOST_NAMED, brief, shortened, similar
from .options import WheelOptions
from .table import HardpointTable
from .templates import NAMES, ROLES, TEMPLATE_NAMES, TEMPLATES, Role, Template, compact, side_of
from .words import by_words, side_in

LARGEST_NAMES = 100_000
# Names as alike as this are taken for misspelt or abridged ones.
LIKE = 0.75
# Names that lack no more roles than this tell the template, for the message on those.
FEW = 2
_SPELLINGS: Mapping[str, str] = {
    other: word for word, others in NAMES["spellings"].items() for other in others
}


def template_of(table: HardpointTable, supplied: WheelOptions) -> tuple[Template, list[str]]:
    """Return the template that the user or the file states, or else the one whose roles the points
    fill by their names, with a note.

    Raises:
        CaseError: there is no such template, two are stated, or it stays open.
    """
    if (stated := stated_template(table, supplied)) is not None:
        return stated, []
    fitting = fitting_templates(table, supplied)
    if not fitting and not supplied.ask_names:  # names may tell it, though not all of its points
        lacking = {each.name: _lacking(table, each) for each in TEMPLATES.values() if each.guessed}
        fewest = min(lacking.values())
        fitting = [TEMPLATES[name] for name, count in lacking.items() if count == fewest <= FEW]
    if len(fitting) != 1:
        problem = "does not say what suspension it is of, expected it from you. Add --template"
        names = " or ".join(each.name for each in fitting) or f"one of {', '.join(TEMPLATES)}"
        raise fault(table.file, "", f"{problem} {names}")
    (found,) = fitting
    return found, [f"template {found.name}, by the names of its points: --template states it"]


def fitting_templates(table: HardpointTable, supplied: WheelOptions) -> list[Template]:
    """Return the templates whose roles the points fill by their names; of several, the largest."""
    guessed = [each for each in TEMPLATES.values() if each.guessed and not supplied.ask_names]
    fitting = [each for each in guessed if _fills(table, each)]
    roles = max((len(each.roles) for each in fitting), default=0)
    return [each for each in fitting if len(each.roles) == roles]


def stated_template(table: HardpointTable, supplied: WheelOptions) -> Template | None:
    """Return the template that the user or the file states; None without.

    Raises:
        CaseError: there is no such template, or two are stated.
    """
    known, said = TEMPLATE_NAMES, supplied.template
    if said is not None and compact(said) not in known:
        raise unknown_name(table.file, "--template", said, TEMPLATES, "a template")
    if table.template is None:
        return None if said is None else known[compact(said)]
    if compact(table.template) not in known:
        problem = (
            f"found {shown(table.template)}, expected one of those that there is a template for."
            f" Known: {', '.join(TEMPLATES)}"
        )
        raise fault(table.file, "Template", problem)
    written = known[compact(table.template)]
    if said is not None and known[compact(said)] is not written:
        problem = (
            f"found {said}, but the file is of a {table.template}, expected {written.name}. Leave"
            " out --template"
        )
        raise fault(table.file, "--template", problem)
    return written


def known_roles(
    table: HardpointTable, template: Template, supplied: WheelOptions
) -> dict[str, str]:
    """Return the points of the roles that names tell, those that are misspelt among them."""
    filled, _, near = _by_names(table, template, supplied, table.roles)
    return filled | {role: name for role, name in near.items() if name}


def fill_roles(
    table: HardpointTable, template: Template, supplied: WheelOptions
) -> tuple[dict[str, str], list[str]]:
    """Return the name of the point for each role of the template, and notes on the names. A file of
    names that does not exist yet is written.

    Raises:
        CaseError: a role has no point, or several, or the file of names is not right.
    """
    own, given = supplied.names, dict(table.roles)
    new = own is not None and not own.exists()
    if own is not None and not new:
        roles = [role.name for role in (*template.roles, *template.optional)]
        given |= _read_own_names(own, roles, table.points)
    unnamed = own if own is not None and not new and not given else None
    filled, by_words, near = _by_names(table, template, supplied, given)
    told = list[str]()
    missing = [role for role in template.roles if role.name not in filled]
    guessed = {role: filled[role] for role in by_words}
    if missing and _sure(near) and not supplied.ask_names:
        filled, guessed, missing = filled | near, guessed | near, []
    if guessed:
        taken = ", ".join(f"{role} is {visible(name)!r}" for role, name in guessed.items())
        told.append(f"names guessed: {taken}. --names FILE states them, --ask-names refuses")
    if unnamed is not None and not missing:
        told.append(f"{unnamed}: all lines are comments, so it names no point")
    if own is not None and new:
        _write_names(own, template, filled)
        told.append(f"{own}: written, with the names of the points by role")
    if not missing:
        return filled, [*told, *_shared(given)]
    unused = [name for name in table.points if name not in filled.values()]
    lines = list[str]()
    for role in missing:
        name = near[role.name]
        where = table.points[name].where if name else ""
        place = "" if where in (name, "") else f", {where}"
        lines.append(f"{role.name}, {role.meaning}" + f" (is it {name!r}{place}?)" * bool(name))
    if unnamed is not None:
        expected = f'expected lines such as {missing[0].name} = "NAME"'
        problem = f"found no names, all lines are comments, {expected}"
        raise fault(unnamed, "", f"{problem}. Take the # away from lines that you fill in")
    problem = f"template {template.name}: missing {'; '.join(lines)}"
    advice = "say with --names FILE which point is which. A new FILE is written to be filled in"
    if new:
        advice = f"fill in {own}, which is written"
    raise fault(
        table.file,
        "",
        f"{problem}. Found beside: {listed(unused)}. Rename or add them, or {advice}",
    )


def _shared(given: Mapping[str, str]) -> list[str]:
    """Return a note for each point that is given for several roles: a strut's top may be its
    spring's, but a slip looks the same.
    """
    roles: dict[str, list[str]] = {}
    for role, name in given.items():
        roles.setdefault(name, []).append(role)
    return [
        f"{' and '.join(several)} are one point, {visible(name)!r}"
        for name, several in roles.items()
        if len(several) > 1
    ]


def _by_names(
    table: HardpointTable, template: Template, supplied: WheelOptions, given: Mapping[str, str]
) -> tuple[dict[str, str], list[str], dict[str, str]]:
    """Return the points of roles by their names, the roles among them by words alone, and for each
    needed role without a point the name most like it, if there is one.

    Args:
        given: points of roles known otherwise.

    Raises:
        CaseError: two points have names of one role.
    """
    exact, worded = _points_by_role(table)
    filled, by_words = dict(given), list[str]()
    for role in (*template.roles, *template.optional):
        if role.name in filled:
            continue
        found = exact(role)
        if len(found) > 1:
            places = " and ".join(f"{name!r} ({table.points[name].where})" for name in found)
            raise fault(
                table.file,
                role.name,
                f"found {places}, expected one point. Remove what {role.meaning} is not",
            )
        if not found and not supplied.ask_names and len(found := worded(role)) == 1:
            by_words.append(role.name)
        if len(found) == 1:
            filled[role.name] = found[0]
    unused = {compact(name): name for name in table.points if name not in filled.values()}
    near = dict[str, str]()
    for role in template.roles:
        if role.name not in filled:
            close = (found for each in role.names if (found := similar(each, unused, LIKE)))
            near[role.name] = unused.get(next(close, ""), "")
    return filled, by_words, near


def _sure(near: Mapping[str, str]) -> bool:
    """Return whether names like those of roles are of one role each, and say nothing else."""
    distinct = len({*near.values()}) == len(near)
    return distinct and all(_fits(role, name) for role, name in near.items())


_Names: TypeAlias = Callable[[Role], list[str]]


def _points_by_role(table: HardpointTable) -> tuple[_Names, _Names]:
    """Return the functions from a role to the points with one of its names, or else with one and
    their side; and to those with a name in other words.
    """
    by_compact_name = dict[str, list[str]]()
    by_side_name = dict[str, list[str]]()
    sides = [*map(side_in, table.points)]
    wheel = table.side or ("right" if "left" not in sides else "left")
    for name in table.points:
        by_compact_name.setdefault(compact(name), []).append(name)
        plain, side = side_of(name)
        if side == wheel:
            by_side_name.setdefault(compact(plain), []).append(name)

    def points(role: Role) -> list[str]:
        names = dict.fromkeys(role.names)
        found = [name for each in names for name in by_compact_name.get(each, ())]
        return found or [name for each in names for name in by_side_name.get(each, ())]

    others = [
        name for name in table.points if not {compact(name), compact(side_of(name)[0])} & ROLES
    ]
    by_word = by_words(others, wheel)
    return points, lambda role: by_word(role.name)


def _fills(table: HardpointTable, template: Template) -> bool:
    """Return whether each role of a template has one point of its own by name."""
    exact, worded = _points_by_role(table)
    found = [exact(role) or worded(role) for role in template.roles]
    return all(len(each) == 1 for each in found) and len({each[0] for each in found}) == len(found)


def _lacking(table: HardpointTable, template: Template) -> int:
    """Return how many roles of a template no name tells."""
    exact, worded = _points_by_role(table)
    return sum(not (exact(role) or worded(role)) for role in template.roles)


def _fits(role: str, name: str) -> bool:
    """Return whether a point's name says nothing else than a role: not lower for upper."""
    words, others = _words(role), _words(name)
    return bool(name) and all(
        not (words & kind and others & kind) or words & kind == others & kind
        for kind in map(frozenset, NAMES["opposites"].items())
    )


def _words(name: str) -> set[str]:
    """Return those of the opposite words that a name has."""
    parts = re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name)
    return {word for part in parts if (word := _SPELLINGS.get(part.lower()))}


def names_text(template: Template, filled: Mapping[str, str]) -> str:
    """Return the text of a file of names, with a comment for each role without a point."""
    lines = [
        f"{role.name} = {json.dumps(filled[role.name], ensure_ascii=False)}"
        if role.name in filled
        else f'# {role.name} = ""  # {role.meaning}'
        for role in (*template.roles, *template.optional)
    ]
    return "\n".join(lines) + "\n"


def _write_names(file: Path, template: Template, filled: Mapping[str, str]) -> None:
    try:
        file.write_text(names_text(template, filled), encoding="utf-8")
    except OSError as error:
        raise fault(file, "--names", f"cannot be written ({error}). Choose another file") from None


def listed(names: Sequence[str]) -> str:
    """Return names as text, abridged if there are more than a suspension has."""
    return shortened([brief(visible(name)) for name in names], MOST_NAMED) or "nothing"


def _read_own_names(file: Path, roles: Iterable[str], points: Iterable[str]) -> Mapping[str, str]:
    """Return the names of points by role, for the roles in a file of `role = "own name"`.

    Args:
        roles: roles of the template.
        points: names of the points of the table.

    Raises:
        CaseError: the file cannot be read, or a role or point is unknown.
    """
    text = read_text(file, LARGEST_NAMES, "it holds a name for each role of a template")
    found = dict[str, str]()
    for role, name in parse(file, text).items():
        require_known(file, role, role, roles, "a role")
        if not isinstance(name, str):
            raise fault(
                file, role, f"found {shown(name)}, expected the name of a point. Write it in quotes"
            )
        require_known(file, role, name, points, "a point of the table")
        found[role] = name
    return found
