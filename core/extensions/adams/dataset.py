"""Statements of a dataset of Adams Solver: KIND/id, ARGUMENT = value, ... with their lines.

The first line is the title, `!` begins a comment, a comma or `&` in front continues a statement,
`;` separates two, keywords may be abbreviated, END ends.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast

from ...case.io.document import fault, shown, unknown_name, usable
from ...errors import CaseError, remedy
from ..formulas.formula import number
from ..xml.ledger import Asked

ARGUMENTS: Mapping[str, str] = {
    "UNITS": "SYSTEM LENGTH MASS FORCE TIME UCF",
    "PART": "GROUND MASS CM IM IP QG REULER ZG XG MATERIAL VX VY VZ WX WY WZ VM WM EXACT",
    "MARKER": (
        "PART POINT_MASS FLEX_BODY NODE_ID QP REULER ZP XP USEXP RM FLOATING CURVE SURFACE VX VY VZ"
    ),
    "JOINT": (
        "REVOLUTE TRANSLATIONAL CYLINDRICAL SPHERICAL UNIVERSAL HOOKE FIXED PLANAR SCREW CONVEL"
        " RACKPIN I J PITCH PD IC ICTRAN ICROT"
    ),
    "JPRIM": "ATPOINT INLINE INPLANE ORIENTATION PARALLEL_AXES PERPENDICULAR I J",
    "COUPLER": "JOINTS TYPE SCALES FUNCTION ROUTINE",
    "GEAR": "JOINTS CV",
    "GCON": "I FUNCTION",
    "MOTION": (
        "I J JOINT TRANSLATION ROTATION X Y Z B1 B2 B3 DISPLACEMENT VELOCITY ACCELERATION ICDISP"
        " ICVEL FUNCTION ROUTINE"
    ),
    "SFORCE": "I J TRANSLATIONAL ROTATIONAL ACTIONONLY FUNCTION ROUTINE",
    "SPRINGDAMPER": "I J TRANSLATIONAL ROTATIONAL K KT C CT LENGTH ANGLE FORCE TORQUE",
    "ACCGRAV": "IGRAV JGRAV KGRAV",
}
"""Arguments of the statements that are read, in full."""
APART: Mapping[str, str] = {
    "PART": "MASS CM IM IP MATERIAL VX VY VZ WX WY WZ VM WM EXACT",
    "MARKER": "POINT_MASS FLEX_BODY NODE_ID CURVE SURFACE VX VY VZ QP REULER ZP XP RM",
    "JOINT": "IC ICTRAN ICROT",
    "MOTION": "ICDISP ICVEL",
    "SPRINGDAMPER": "ANGLE LENGTH FORCE TORQUE K C KT CT",
    "GCON": "I",
}
"""Arguments of read statements without meaning for kinematics, or for statements of some types:
initial velocities, markers on no part, the mass of the ground.
"""
FORCING = (
    "BUSHING BEAM FIELD GFORCE VFORCE VTORQUE NFORCE MFORCE CONTACT FRICTION CLEARANCE TIRE"
    " FLEX_BODY POINT_MASS PTCV CVCV UCON FEPART FELOAD FENODE"
)
"""Statements that force or constrain the motion, and are not read."""
_OTHERS = (
    "ADAMS ARRAY CONTROL CURVE DEBUG DIFF EQUILIBRIUM GRAPHICS GSE IC INTEGRATOR KINEMATICS LIST"
    " LSE LSOLVER MATERIAL MATRIX MREQUEST OUTPUT PINPUT POUTPUT PREFERENCES REQUEST RESULTS SENSOR"
    " SPLINE STRING SURFACE TFSISO VARIABLE"
)
"""Statements without force: their content acts by functions that name it, which are not read."""
KNOWN = (*ARGUMENTS, *FORCING.split(), *_OTHERS.split())
_ONCE = ("UNITS", "ACCGRAV")
# A comma in front of a line: it continues a statement, and separates arguments but no formula.
_CONTINUED = "\x1f"
_HEAD = re.compile(r"([A-Za-z]\w*)\s*/\s*(\d{0,10})(?!\d)")
_ARGUMENT = re.compile(r"\s*([A-Za-z]\w*)\s*=(.*)", re.DOTALL)
MOST_STATEMENTS = 100_000


@dataclass(frozen=True, eq=False)
class Statement:
    """A statement of a dataset.

    Attributes:
        line: of its begin, counted from one.
        values: texts of the arguments, by name in full.
        flags: arguments without a value.
    """

    file: Path
    kind: str
    id: int
    line: int
    values: Mapping[str, str] = field(default_factory=lambda: Asked({}))
    flags: Sequence[str] = ()

    @property
    def name(self) -> str:
        """Name of the defined object: JOINT_1."""
        return f"{self.kind}_{self.id}"

    @property
    def label(self) -> str:
        """Its line, kind and identifier, for messages."""
        name = f"{self.kind}/{self.id}" if self.kind not in _ONCE else self.kind
        return f"line {self.line}: {name}"

    def fault(self, problem: str) -> CaseError:
        """Return an error with the statement and its line."""
        return fault(self.file, self.label, problem)

    def numbers(self, name: str, count: int | None = None) -> list[float]:
        """Return the numbers of an argument; angles with a D are degrees [rad].

        Raises:
            CaseError: they are no numbers, or not as many.
        """
        text = self.values[name]
        try:
            found = [number(each) for each in re.split(r"[\s,:\x1f]+", text.strip()) if each]
        except ValueError:
            found = []
        if not found or len(found) != (count or len(found)) or not all(map(usable, found)):
            expected = f"{count} number{'s' * (count != 1)}" if count else "numbers"
            raise self.fault(
                f"{name}: found {shown(_plain(text))}, expected {expected}; correct it"
            )
        return found

    def one(self, name: str, default: float | None = None) -> float:
        """Return the number of an argument.

        Raises:
            CaseError: it is no number, or missing and without a default.
        """
        if name in self.values:
            return self.numbers(name, 1)[0]
        if default is None:
            raise self.fault(f"{name} is missing, expected a number; add {name} = ...")
        return default

    def ids(self, name: str) -> list[int]:
        """Return the identifiers of an argument.

        Raises:
            CaseError: it is missing, or they are no whole numbers.
        """
        words = [x for x in re.split(r"[\s,:\x1f]+", self.values.get(name, "").strip()) if x]
        if not words or not all(x.isascii() and x.isdigit() and len(x) <= 10 for x in words):
            given = shown(_plain(self.values.get(name, "nothing")))
            raise self.fault(f"{name}: found {given}, expected an identifier; correct it")
        return [*map(int, words)]

    def id_of(self, name: str) -> int:
        """Return the only identifier of an argument.

        Raises:
            CaseError: it is missing, or there are several.
        """
        wanted, *more = self.ids(name)
        if more:
            problem = f"found {1 + len(more)} identifiers, expected one; correct it"
            raise self.fault(f"{name}: {problem}")
        return wanted

    def choice(self, *names: str) -> str:
        """Return which of some flags it has; empty without any.

        Raises:
            CaseError: it has several.
        """
        found = [name for name in names if name in self.flags]
        if len(found) > 1:
            raise self.fault(f"found {' and '.join(found)}, expected one of them; remove the other")
        return found[0] if found else ""

    @property
    def function(self) -> str:
        """The text of FUNCTION, on one line.

        Raises:
            CaseError: it is missing, or a line may be a sum or the next number of a list.
        """
        if "ROUTINE" in self.values or "FUNCTION" not in self.values:
            found = "a ROUTINE" if "ROUTINE" in self.values else "no FUNCTION"
            raise self.fault(f"found {found}, expected FUNCTION = a formula; give one")
        text = self.values["FUNCTION"]
        parts = [each.strip() for each in text.split(_CONTINUED)]
        found = parts[0]
        for part in parts[1:]:
            ends, begins = found[-1:] not in "+-*/(,", part[:1] not in "+-*/),"
            if ends and begins:
                found += ","
            elif ends and part[:1] in "+-" and _in_call(found):
                raise self.fault(
                    f"FUNCTION: found a line that begins with {shown(part[:12])} in a list, which"
                    " may be a sum or the next number; end the line before it by a comma or a sign"
                )
            found += f" {part}"
        return found


def _in_call(text: str) -> bool:
    """Return whether the end of a text is among the arguments of a function."""
    stack = list[bool]()
    for k, letter in enumerate(text):
        if letter == "(":
            stack.append(text[:k].rstrip()[-1:].isalnum())
        elif letter == ")" and stack:
            stack.pop()
    return bool(stack) and stack[-1]


def _plain(text: str) -> str:
    return " ".join(text.replace(_CONTINUED, ",").split())


@dataclass(frozen=True, eq=False)
class Dataset:
    """The statements of a dataset.

    Attributes:
        statements: read ones, by kind and identifier.
        left_out: number of others, by kind.
        without: statements left out as the user wants it, although they force the motion.
        notes: on assumptions.
    """

    file: Path
    title: str
    statements: Mapping[str, Mapping[int, Statement]]
    left_out: Mapping[str, int]
    without: Sequence[str]
    notes: list[str]

    def of(self, *kinds: str) -> list[Statement]:
        """Return the statements of some kinds."""
        return [each for kind in kinds for each in self.statements.get(kind, {}).values()]

    def unread(self) -> Counter[str]:
        """Return the unread arguments, by name and kind.

        Raises:
            CaseError: one of them may mean something for kinematics.
        """
        found = Counter[str]()
        for kind, statements in self.statements.items():
            for each in statements.values():
                for name in cast("Asked", each.values).unasked:
                    if name not in APART.get(kind, "").split():
                        raise each.fault(
                            f"{name} = {shown(_plain(each.values[name]))} is not read beside its"
                            " other arguments, expected it alone; remove it, or the statement by"
                            f" --without {kind}/{each.id}"
                        )
                    found[f"{name} of {kind}"] += 1
        return found

    def once(self, kind: str) -> Statement | None:
        """Return the only statement of a kind, or None."""
        return next(iter(self.of(kind)), None)

    def member(
        self, owner: Statement, name: str, kind: str, wanted: int | None = None
    ) -> Statement:
        """Return a statement by its identifier, by default that in the argument `name` of `owner`,
        which needs it.
        """
        known = self.statements.get(kind, {})
        wanted = owner.id_of(name) if wanted is None else wanted
        if wanted not in known:
            raise owner.fault(
                f"{name} = {wanted}: there is no {kind}/{wanted}, expected one of the dataset;"
                f" {remedy(str(wanted), map(str, known))}"
            )
        return known[wanted]


def read_dataset(file: Path, text: str, without: Collection[str]) -> Dataset:
    """Read the statements of a dataset.

    Args:
        without: kinds, or KIND/id, of statements to leave out although they force the motion.

    Raises:
        CaseError: a line is no statement, or forces the motion and is not read.
    """
    title, lines = _title(file, text)
    wanted = {name.upper() for name in without}
    used = set[str]()
    found = dict[str, dict[int, Statement]]()
    left_out = Counter[str]()
    for count, (line, statement) in enumerate(_statements(file, lines)):
        if count > MOST_STATEMENTS:
            raise fault(file, "", f"found more than {MOST_STATEMENTS} statements; split the model")
        if statement.strip().upper() == "END":
            break
        kind, identifier, rest = _head_of(file, line, statement, wanted)
        bare = Statement(file, kind, identifier, line)
        named = wanted & {kind, f"{kind}/{identifier}"}
        if named:
            used |= named
            continue
        if kind in FORCING.split():
            raise bare.fault(
                "forces the motion and cannot be read; give a model without it, or leave it out by"
                f" --without {kind} or --without {kind}/{identifier}"
            )
        if kind in _OTHERS.split():
            left_out[kind] += 1
            continue
        own = found.setdefault(kind, {})
        if identifier in own:
            raise bare.fault(
                f"found again, expected it once; it is in line {own[identifier].line} already"
            )
        own[identifier] = _arguments(bare, rest)
    for name in sorted(wanted - used):
        raise unknown_name(
            file, "--without", name, [*found, *FORCING.split()], "a statement of the dataset"
        )
    return Dataset(file, title, found, left_out, sorted(used), [])


def _title(file: Path, text: str) -> tuple[str, list[tuple[int, str]]]:
    """Return the title, and all other lines with their numbers.

    A comment may stand before the title; it is the first line anyway.
    """
    lines = [*enumerate(re.split(r"\r\n|\r|\n", text), 1)]
    title = lines[0][1].strip()
    del lines[0]
    if title.startswith("!") and (others := [each for each in lines if _bare(each[1])]):
        begun, first = others[0]
        if not _HEAD.match(_bare(first)):
            title = first.strip()
            lines = [each for each in lines if each[0] > begun]
    elif (head := _HEAD.match(title)) and head[1].upper() in ARGUMENTS:
        raise fault(
            file,
            "line 1",
            f"found {shown(title)}, which Adams takes for the title; put a title in front of it",
        )
    return title.strip("! "), lines


def _bare(line: str) -> str:
    """Return a line without its comment."""
    return line.split("!", 1)[0].strip()


def _statements(file: Path, lines: Sequence[tuple[int, str]]) -> Iterator[tuple[int, str]]:
    """Yield whole statements with the number of their first line."""
    begun, parts = 0, list[str]()
    open_end = False
    for line_number, raw in lines:
        line = _bare(raw)
        if not line:
            continue
        continues = line[0] in ",&" or open_end
        if continues and not parts:
            raise fault(
                file,
                f"line {line_number}",
                f"found {shown(line)}, which continues no statement; begin one by KIND/id",
            )
        if not continues and parts:
            yield from _split_at_semicolons(begun, "".join(parts))
            parts = []
        if not parts:
            begun = line_number
        body = line.lstrip("&") if line[0] == "&" else line
        body = _CONTINUED + body[1:] if body[:1] == "," else body
        open_end = body.endswith("&")
        parts.append(f" {body.removesuffix('&')}" if continues else body.removesuffix("&"))
    if parts:
        yield from _split_at_semicolons(begun, "".join(parts))


def _split_at_semicolons(line: int, text: str) -> Iterator[tuple[int, str]]:
    yield from ((line, each) for each in text.split(";") if each.strip(f" \t{_CONTINUED},"))


def _head_of(file: Path, line: int, text: str, without: Collection[str]) -> tuple[str, int, str]:
    """Return kind, identifier and the rest of a statement."""
    head = _HEAD.match(text.strip())
    if head is None:
        found = shown(_plain(text)[:60])
        problem = f"found {found}, expected a statement KIND/id, ARGUMENT = value, ..."
        raise fault(file, f"line {line}", f"{problem}; correct it, or begin comments by !")
    where = f"line {line}"
    kind = full_name(head[1].upper(), (*KNOWN, *(each.partition("/")[0] for each in without)))
    if not kind:
        raise unknown_name(
            *(file, where, _plain(head[0]), KNOWN),
            "a statement of Adams Solver that is known, whose abbreviation fits one alone",
        )
    if not head[2] and kind in ARGUMENTS and kind not in _ONCE:
        raise fault(file, where, f"found {kind} without an identifier; write {kind}/1")
    return kind, int(head[2] or 0), text.strip()[head.end() :]


def full_name(word: str, known: Collection[str]) -> str:
    """Return the name of an abbreviation, or of a longer word, as ROTATIONAL for ROTATION; empty if
    it is none, or several.
    """
    if word in known:
        return word
    found = [name for name in known if name.startswith(word)]
    if not found and len(word) > 3:
        longer = [name for name in known if len(name) > 3 and word.startswith(name)]
        found = [max(longer, key=len)] if longer else []
    return found[0] if len(found) == 1 else ""


def _arguments(bare: Statement, rest: str) -> Statement:
    """Return the statement with the arguments of its text."""
    known = ARGUMENTS[bare.kind].split()
    values = dict[str, str]()
    flags = list[str]()
    current = ""
    for part in _parts(rest):
        separator, text = part[:1], part[1:]
        found = _ARGUMENT.fullmatch(text)
        if found and (name := full_name(found[1].upper(), known)):
            if name in values:
                raise bare.fault(f"found {name} twice, expected it once; remove one")
            values[name] = found[2].strip()
            current = name
        elif found and current != "FUNCTION":
            raise bare.fault(
                f"found {found[1]} =, which is no argument of it, or short for several;"
                f" {remedy(found[1].upper(), known)}"
            )
        elif current and (current == "FUNCTION" or text.strip()[:1] in (*"+-.:", *"0123456789")):
            values[current] += separator + text
        elif word := text.strip().upper():
            flag = full_name(word, known)
            # the values of SYSTEM, EXACT and TYPE are words, and follow each other
            if not flag and current in ("TYPE", "EXACT"):
                values[current] += separator + text
                continue
            if not flag:
                raise bare.fault(
                    f"found {shown(word)}, which is no argument of it, or short for several;"
                    f" {remedy(word, known)}"
                )
            flags.append(flag)
            current = ""
    return replace(bare, values=Asked(values), flags=flags)


def _parts(text: str) -> Iterator[str]:
    """Yield the parts between commas, line begins and backslashes, each with its separator;
    those within parentheses and quotes separate nothing.
    """
    depth, quoted, part = 0, "", ","
    for letter in text:
        quoted = "" if letter == quoted else quoted or (letter if letter in "\"'" else "")
        depth += (letter == "(") - (letter == ")")
        if letter in f",\\{_CONTINUED}" and depth <= 0 and not quoted:
            if part[1:].strip() or letter != _CONTINUED:
                yield part
                part = "," if letter == "\\" else letter
            continue
        part += letter
    yield part
