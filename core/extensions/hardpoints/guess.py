"""One question about all open facts of a table: unit, axes, template, side, radius and names of
points, each guessed from texts of the table and from its geometry.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...case.io.escape import visible
from ...case.units import LENGTHS
from ...errors import CaseError, OpenError
from .options import WheelOptions
from .roles import fitting_templates, known_roles, names_text, stated_template
from .table import HardpointTable, axes_of
from .templates import ROLES, TEMPLATES, WHEEL_CENTER, WHEEL_CONTACT, Template, compact, side_of
from .words import axes_said, first_said, side_in, template_said, unit_said

if TYPE_CHECKING:
    from .fitting import Fit

# Half of the track of cars, race cars and lorries [m], and of a usual car.
HALF_TRACKS, USUAL = (0.4, 1.25), 0.72
USED = ("mm", "m", "inch", "cm", "foot")
# Radii of loaded wheels [m].
RADII = 0.18, 0.55
# An assignment is refused that is less like a sample than any car, and doubtful if another one is
# nearly as good.
WORST, NEARLY = 6.0, 1.5
# As many roles by name tell the template.
ENOUGH = 4
# More points than a corner has are not searched.
MOST = 60


def guess_of(
    table: HardpointTable,
    supplied: WheelOptions,
    case_of: Callable[[HardpointTable, WheelOptions], object],
) -> Guess | None:
    """Return a guess of the open facts, after a trial; None if nothing is open, or no guess is
    like a suspension.

    Args:
        case_of: makes the case of a table.

    Raises:
        CaseError: a fact of table or user is not right.
    """
    own = supplied.names
    few = 3 <= len(table.points) <= MOST
    if supplied.ask_names or (own is not None and own.exists()) or not few:
        return None
    stated = stated_template(table, supplied)
    templates = [stated] if stated else fitting_templates(table, supplied)
    decided, named = len(templates) == 1, False
    if decided:
        roles = {each.name for each in templates[0].roles}
        named = roles <= known_roles(table, templates[0], supplied).keys()
    wanted = {
        "units": not (table.unit or supplied.units),
        "axes": not (table.axes or supplied.axes),
        "template": not decided,
        "names": not named,
    }
    if not any(wanted.values()):
        return None
    if not decided:
        hint = first_said(template_said, [table.file.stem, *table.texts])
        every = [each for each in TEMPLATES.values() if each.guessed]
        templates = [TEMPLATES[hint]] if hint else templates or every
    known = {each.name: known_roles(table, each, supplied) for each in templates}
    most = max(map(len, known.values()))
    if most >= ENOUGH:  # names tell the template, though not all of its points
        templates = [each for each in templates if len(known[each.name]) == most]
    for found, doubts in _likely(table, supplied, templates, known):
        if not decided:
            needed = {each.name for each in found.template.roles}
            wanted["names"] = not needed <= known[found.template.name].keys()
            fitting = [each for each in templates if len(each.roles) <= len(found.roles)]
            like = [each.name for each in fitting if each is not found.template]
            told = len(known[found.template.name]) == most >= ENOUGH
            doubts = [*doubts, *(f"it may be a {name}" for name in like if told)]
        guess = Guess(table, supplied, wanted, found, [*dict.fromkeys(doubts)])
        with suppress(CaseError):
            case_of(replace(table, roles=found.roles), guess.taken)
            return guess
    return None


def _likely(
    table: HardpointTable,
    supplied: WheelOptions,
    templates: Sequence[Template],
    known: Mapping[str, Mapping[str, str]],
) -> list[tuple[Fit, list[str]]]:
    """Return the likely assignments, the best first, each with its doubts."""
    from .fitting import WORDS, every_axes, fits  # slow

    side = supplied.side or table.side
    points = _of_one_side(table, side)
    known = {
        template: {role: name for role, name in roles.items() if name in points}
        for template, roles in known.items()
    }
    found: list[Fit] = []
    stated = first_said(axes_said, table.texts)
    if supplied.axes or table.axes:
        places = axes_of(table, supplied.axes)
        stated = ",".join(WORDS[k][sign < 0.0] for k, sign in places)
    for axes in ([stated],) if stated else (every_axes(), every_axes(right_handed=False)):
        every = fits([(one, _free(points, one), known[one.name]) for one in templates], axes)
        found = [fit for fit in every if fit.cost < WORST and side in (None, _side(points, fit))]
        if found:
            break
    likely: list[tuple[Fit, list[str]]] = []
    for fit in found[:3]:
        others = [
            each for each in found if each is not fit and each.cost < NEARLY * fit.cost + 0.02
        ]
        doubts = list[str]()
        for other in others:
            if other.template is not fit.template:
                doubts.append(f"it may be a {other.template.name}")
            moved = [role for role, name in other.roles.items() if fit.roles.get(role) != name]
            if other.axes == fit.axes and other.template is fit.template and moved:
                doubts.append(f"{' and '.join(moved[:4])} may be other points")
            if other.axes != fit.axes and other.template is fit.template:
                doubts.append(f"the axes may be {other.axes}")
        likely.append((fit, [*dict.fromkeys(doubts)]))
    return likely


def _of_one_side(table: HardpointTable, side: str | None) -> dict[str, Sequence[float]]:
    """Return the coordinates of the points whose names say no other side."""
    sides = {name: side_in(name) for name in table.points}
    own = side or ("left" if "left" in sides.values() else "right")
    return {name: p.position for name, p in table.points.items() if sides[name] in ("", own)}


def _free(
    points: Mapping[str, Sequence[float]], template: Template
) -> Mapping[str, Sequence[float]]:
    """Return the points whose names are not those of roles of other templates alone."""
    own = {each for role in (*template.roles, *template.optional) for each in role.names}
    return {
        name: at
        for name, at in points.items()
        if (word := compact(side_of(name)[0])) not in ROLES or word in own
    }


def _column(fit: Fit, words: tuple[str, str]) -> tuple[int, float]:
    """Return the column of a direction among its two words, and its sign."""
    each = fit.axes.split(",")
    k = next(k for k, word in enumerate(each) if word in words)
    return k, 1.0 if each[k] == words[0] else -1.0


def _side(points: Mapping[str, Sequence[float]], fit: Fit) -> str:
    k, sign = _column(fit, ("left", "right"))
    return "left" if sign * points[fit.roles[WHEEL_CENTER]][k] > 0.0 else "right"


class Guess:
    """A guess of the open facts.

    Attributes:
        stated: the guess by the options' fields.
        why: a line for each.
        taken: the user's options with the guess, but for the names.
        fit: template, axes and roles.
        doubts: possible mistakes.
    """

    def __init__(
        self,
        table: HardpointTable,
        supplied: WheelOptions,
        wanted: Mapping[str, bool],
        fit: Fit,
        doubts: Sequence[str],
    ) -> None:
        self.table, self.supplied, self.fit, self.doubts = table, supplied, fit, doubts
        self.points = {name: each.position for name, each in table.points.items()}
        self.stated, self.why = dict[str, str](), list[str]()
        self.writes = dict[Path, str]()
        if wanted["units"]:
            self._units()
        if wanted["axes"]:
            self._say("axes", fit.axes, self._why_axes())
        if wanted["template"]:
            self._say("template", fit.template.name, "the points are most like its sample")
        side = _side(self.points, fit)
        if wanted["axes"] and side == "right" and not (supplied.side or table.side):
            self._say("side", side, "the wheel is right of the middle in these axes")
        if wanted["units"] or wanted["axes"]:
            self._radius()
        changed: dict[str, Any] = dict(self.stated)
        self.taken = replace(supplied, names=None, **changed)
        if wanted["names"]:
            self._names()

    def question(self) -> OpenError:
        """Return the question."""
        doubts = f"  Doubtful: {', '.join(self.doubts)}." if self.doubts else ""
        why = [*self.why, *filter(None, [doubts])]
        return OpenError(self.table.file, why, self.stated, self.writes)

    def _say(self, option: str, text: str, why: str) -> None:
        self.stated[option] = text
        self.why.append(f"  --{option.replace('_', '-')} {text}: {why}.")

    def _units(self) -> None:
        k, _ = _column(self.fit, ("left", "right"))
        wheel = self.fit.roles[WHEEL_CENTER]
        half = abs(self.points[wheel][k])
        said = [unit for each in self.table.texts if (unit := unit_said(each))]
        sizes = {name: LENGTHS[name](half) for name in USED}
        likely = [each for each in USED if HALF_TRACKS[0] <= sizes[each] <= HALF_TRACKS[1]]
        likely.sort(key=lambda each: abs(sizes[each] / USUAL - 1.0))
        unit = next((each for each in said if each in likely), next(iter(likely), ""))
        if not unit:
            raise CaseError("")  # no such car
        text = f"{visible(wheel)} is then {sizes[unit]:.3g} m from the middle"
        if unit in said:
            text = f"a text of the file says so, and {text}"
        elif len(likely) > 1:
            text += f", but {likely[1]} would be possible too"
        self._say("units", unit, text)

    def _why_axes(self) -> str:
        """Return the reason for the axes."""
        said = first_said(axes_said, self.table.texts)
        if said == self.fit.axes:
            return "a text of the file says so"
        roles = self.fit.roles
        ahead, above = (
            next((pair for pair in pairs if {*pair} <= roles.keys()), None)
            for pairs in (self.fit.template.ahead, self.fit.template.above[::-1])
        )
        names = {role: visible(name) for role, name in roles.items()}
        told = [f"{names[WHEEL_CENTER]} is the outermost"]
        told += [f"{names[ahead[0]]} is ahead of {names[ahead[1]]}"] if ahead else []
        told += [f"{names[above[0]]} above {names[above[1]]}"] if above else []
        return ", ".join(told)

    def _radius(self) -> None:
        """Take z = 0 for the road if all points are above it and the wheel's centre is as high as a
        wheel is.
        """
        unit = self.stated.get("units") or self.supplied.units or self.table.unit
        given = self.supplied.wheel_radius or self.table.wheel_radius
        if WHEEL_CONTACT in self.fit.roles or given or unit is None:
            return
        k, sign = _column(self.fit, ("up", "down"))
        heights = {name: sign * point[k] for name, point in self.points.items()}
        center = heights[self.fit.roles[WHEEL_CENTER]]
        size = next((LENGTHS[unit](center) for name in [unit] if name in LENGTHS), 0.0)
        if RADII[0] <= size <= RADII[1] and min(heights.values()) > 0.0:
            why = (
                f"{visible(self.fit.roles[WHEEL_CENTER])} is so far above {'xyz'[k]} = 0, the road"
            )
            self._say("wheel_radius", f"{1e3 * size:.6g}mm", why)

    def _names(self) -> None:
        """State the names by a new file."""
        text = names_text(self.fit.template, self.fit.roles)
        file = self.supplied.names or self.table.file.with_name(
            f"{self.table.file.stem}_names.toml"
        )
        tries = itertools.chain(
            [file], (file.with_name(f"{file.stem}_{k}.toml") for k in range(2, 1000))
        )
        for each in tries:
            if not each.exists() or each.read_bytes() == text.encode():
                break
        else:
            return
        self.writes = {each: text}
        listed = ", ".join(f"{r} is {visible(n)}" for r, n in self.fit.roles.items())
        self._say("names", str(each), f"by their places, {listed}. Correct a line there")
