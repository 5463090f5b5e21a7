"""Meaning of the columns of a recording: time, drivers, outputs, and poses of bodies, whose
attitudes are Euler angles of any sequence, or quaternions, of body to global or the inverse.

Known by their names, or as the user states it by --map: an equation NAME=COLUMN+OFFSET or
COLUMN=NAME+OFFSET for a number, and for a body BODY=PREFIX: X Y Z, ATTITUDE, ...
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from itertools import product
from operator import mul
from pathlib import Path

import numpy as np

from ...algebra import Quat, Vec3, X, Y, Z, quat
from ...case.case import TIME, Case, Quantity
from ...case.io.document import decimal, fault, number_or_nan, require_known, shown, unknown_name
from ...case.io.reference_samples import RATES, known_columns
from ...case.io.table import UNIT_NAMES, read_unit, require_unit
from ...case.units import ANGLES
from ...errors import MOST_NAMED, brief, shortened, similar
from ...trajectory import QUANTITIES, Array
from .readers import Column, Head, Recording

SEQUENCES = tuple(
    "".join(each) for each in product("123", repeat=3) if each[0] != each[1] != each[2]
)
"""The twelve sequences of axes; 1 is x."""
ORDERS = ("wxyz", "xyzw")
PLANE = "3"
"""One angle, about global z: the attitude of a planar pose."""
_AXIS_OF: dict[str, Vec3] = {"1": X, "2": Y, "3": Z}


@dataclass(frozen=True)
class Reading:
    """The meaning of the numbers of an attitude.

    Attributes:
        order: of the axes of three angles or of one, or of the parts of a quaternion.
        fixed: whether the angles are about fixed axes, and not about those of the body.
        inverted: whether they turn global axes into those of the body.
    """

    order: str
    fixed: bool = False
    inverted: bool = False

    @property
    def angles(self) -> bool:
        """Whether the numbers are angles."""
        return self.order in (*SEQUENCES, PLANE)

    def __str__(self) -> str:
        """Return its words in --map."""
        kind = "euler" if self.angles else "quaternion"
        words = [kind, self.order, *["fixed"] * self.fixed, *["inverted"] * self.inverted]
        return " ".join(words)

    def parameters(self, numbers: Sequence[Array]) -> Array:
        """Return Euler parameters of body -> global, shape (n, 4).

        Args:
            numbers: angles [rad], or four parts of any length but zero, shape (n,) each.
        """
        if self.angles:
            turns = [
                Quat(np.cos(0.5 * angle), np.sin(0.5 * angle) * _AXIS_OF[axis])
                for axis, angle in zip(self.order, numbers, strict=True)
            ]
            q = reduce(mul, turns[::-1] if self.fixed else turns)
        else:
            w = self.order.index("w")
            q = quat((numbers[w], *(x for k, x in enumerate(numbers) if k != w)))
        q = q.conjugate() if self.inverted else q
        found = np.stack([q.e0, *q.e], axis=-1)
        with np.errstate(invalid="ignore", divide="ignore"):
            return found / np.linalg.norm(found, axis=1)[:, None]


def all_readings(count: int) -> list[Reading]:
    """Return all readings of one or three angles or of four parts of a quaternion."""
    flags = (False, True)
    if count == 1:
        return [Reading(PLANE, inverted=inverted) for inverted in flags]
    if count == 4:
        return [Reading(order, inverted=inverted) for order in ORDERS for inverted in flags]
    return [Reading(*each) for each in product(SEQUENCES, flags, flags)]


MAP = "--map"
EVENT = "event"
# A name this similar to another one is that with a typing error.
CLOSE = 0.75
_AXES = {"x": "1", "y": "2", "z": "3"}
_OF_MOTION = {"velocity": "m/s", "omega": "rad/s", "acceleration": "m/s^2", "alpha": "rad/s^2"}
_UNITS = {"position": "m", "attitude": "rad", **_OF_MOTION}
_ADAMS = {
    "position": ("X", "Y", "Z"),
    "attitude": ("PSI", "THETA", "PHI"),
    "velocity": ("VX", "VY", "VZ"),
    "omega": ("WX", "WY", "WZ"),
    "acceleration": ("ACCX", "ACCY", "ACCZ"),
    "alpha": ("WDX", "WDY", "WDZ"),
}
"""Components of the pose of a part in results of Adams; its angles are about axes of the body."""
_PLANAR = {"position": "attitude", "velocity": "omega", "acceleration": "alpha"}
"""What the third column of a planar pose and its rates is: about z."""
# The last word in the name of a third component along z: z and vz, not wz.
_UPWARDS = re.compile(r"(?!w|om|al).*z")
_NEEDS = (
    *(("velocity", "omega"), ("omega", "velocity"), ("acceleration", "velocity")),
    *(("acceleration", "alpha"), ("alpha", "acceleration")),
)
REACTIONS = {"FX": "N", "FY": "N", "FZ": "N", "TX": "N m", "TY": "N m", "TZ": "N m"}
"""Endings of columns of a joint's reaction, with units: on its second body, about its point, along
global axes; as Adams names those on the marker I.
"""
_IN_BRACKETS = re.compile(r"(.*?)\s+\[([^\[\]]*)\]")
_QUATERNIONS = {"wxyz": ("e0", "e1", "e2", "e3"), "xyzw": ("qx", "qy", "qz", "qw")}
FORM = (
    'Say --map "NAME=COLUMN", "NAME=-COLUMN+12 [mm]", or of a body --map "BODY=PREFIX: x y z, euler'
    ' 321 a b c [deg]", "BODY=PREFIX: x y z, quaternion xyzw qx qy qz qw" or, planar,'
    ' "BODY=PREFIX: x y angle, velocity vx vy w"'
)

ACCURACY = "--accuracy"
ACCURACY_FORM = (
    f'Say {ACCURACY} "acceleration=1e-4" for a share of the largest, or {ACCURACY} "toe=0.02 deg"'
)
_ROW_UNITS = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}


@dataclass(frozen=True)
class Use:
    """A quantity of the case as sign * column + offset.

    Attributes:
        si: SI unit of the quantity.
        unit: as the user states it, of the offset and of a column without a unit.
    """

    column: int
    si: str
    unit: str = ""
    sign: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Pose:
    """The columns of the pose of a body, and their meaning.

    Attributes:
        groups: columns by position, attitude, velocity, omega, acceleration and alpha; in the plane
            x and y, or one about z.
        turned: omega and alpha, if along the axes of the recorded frame.
        frame: origin and Euler parameters of the recorded frame at design, global; empty for the
            body's own frame, None for the frame whose first sample is the design pose.
    """

    groups: Mapping[str, tuple[Use, ...]]
    reading: Reading
    turned: tuple[str, ...] = ()
    frame: tuple[float, ...] | None = ()


@dataclass(frozen=True)
class Meaning:
    """The meaning of the columns of a recording.

    Attributes:
        numbers: columns of time, of drivers and outputs, and of their derivatives, by name.
        bodies: poses by body.
        event: which of several rows at one time is taken, "first" or "last"; empty if they must be
            equal.
        unknown: columns without a meaning.
    """

    numbers: Mapping[str, Use]
    bodies: Mapping[str, Pose]
    event: str = ""
    unknown: Sequence[str] = ()

    @property
    def uses(self) -> list[Use]:
        """All columns with a meaning."""
        poses = (use for pose in self.bodies.values() for g in pose.groups.values() for use in g)
        return [*self.numbers.values(), *poses]


def inputs_of(case: Case) -> dict[str, str]:
    """Return the possible names of columns of time and drivers, with their SI units."""
    units = {TIME: "s"}
    for driver in case.mechanism.drivers:
        si = "rad" if driver.turns else "m"
        units |= {driver.name + ending: si + per for ending, per in RATES.items()}
    return units


@dataclass
class Reader:
    """Reads the meaning of the columns of a file for a case, by the texts of --map."""

    file: Path
    case: Case
    heads: Sequence[Head]

    @cached_property
    def targets(self) -> Mapping[str, str]:
        """The possible names of a column, with their SI units."""
        case = self.case
        joints = case.mechanism.joints if case.mechanism.has_loads else ()
        reactions = {f"{joint.name}.{end}": si for joint in joints for end, si in REACTIONS.items()}
        return inputs_of(case) | reactions | known_columns(case.outputs)

    def read(self, texts: Sequence[str]) -> Meaning:
        """Return the meaning.

        Raises:
            CaseError: a text has another form, a name is unknown or twice, or no column means
                anything.
        """
        numbers = dict[str, Use]()
        bodies = dict[str, Pose]()
        event = ""
        prefixes = {body.name: body.name for body in self.case.mechanism.moving}
        for text in texts:
            left, equals, right = (part.strip() for part in text.rpartition("="))
            if not (left and equals and right):
                raise self._fault(f"found {shown(text)}, expected an equation. {FORM}")
            if left in (*numbers, *bodies) or prefixes.get(left, left) != left:
                raise self._fault(f"found {shown(left)} twice, expected it once. Leave one out")
            if left == EVENT and right in ("first", "last"):
                event = right
            elif left in prefixes and ("," in right or ":" in right):
                bodies[left] = self._pose(right)
            elif left in prefixes and left not in self.targets:
                prefixes[left] = right
            else:
                name, use = self._number(text, left, right)
                numbers[name] = use
        taken = {use.column for use in Meaning(numbers, bodies).uses}
        numbers |= self._columns_by_name(numbers, taken)
        bodies |= {name: pose for name, pose in self._poses_by_name(prefixes) if name not in bodies}
        for body, prefix in prefixes.items():
            if prefix != body and body not in bodies:
                problem = f"found no pose of {body} in columns of known names below {shown(prefix)}"
                raise self._fault(f"{problem}. {FORM}")
        if not {*numbers} - {TIME} and not bodies:
            listed = shortened([brief(shown(head.name)) for head in self.heads], MOST_NAMED)
            known = shortened([*map(brief, [n for n in self.targets if n != TIME][:6])], MOST_NAMED)
            problem = f"found the columns {listed or 'none'}, expected one of {known}, or poses"
            raise fault(self.file, "", f"{problem} of {', '.join(prefixes)}. {FORM}")
        found = Meaning(numbers, bodies, event)
        taken = {use.column for use in found.uses}
        left = [head.name for k, head in enumerate(self.heads) if k not in taken]
        known = [name for name in self.targets if name not in numbers]
        # a typing error, and not one of thousands of other quantities
        close = {name: similar(name, known, CLOSE) for name in left[:MOST_NAMED]}
        hints = [f"{shown(name)} (is it {other}?)" for name, other in close.items() if other]
        others = [shown(name) for name in left if not close.get(name)]
        return replace(found, unknown=[*hints, *others])

    def _fault(self, problem: str) -> Exception:
        return fault(self.file, MAP, problem)

    def _columns_by_name(self, stated: Collection[str], taken: Collection[int]) -> dict[str, Use]:
        """Return the columns with names of quantities, but for capitals and separators."""
        found = dict[str, Use]()
        names = {_normal(name): name for name in self.targets}
        for k, head in enumerate(self.heads):
            # Adams names the abscissa time.TIME
            name = names.get(_normal(head.name), TIME if head.name == "time.TIME" else "")
            if name == "" or name in stated or k in taken:
                continue
            if name.rpartition(".")[2] in REACTIONS and read_unit(head.unit or "N") is None:
                continue
            if name in found:
                both = f"{shown(self.heads[found[name].column].name)} and {shown(head.name)}"
                problem = f"found the columns {both}, expected one for {name}"
                raise fault(self.file, "", f'{problem}. Say which by {MAP} "{name}=COLUMN"')
            found[name] = Use(k, self.targets[name])
        return found

    def _number(self, text: str, left: str, right: str) -> tuple[str, Use]:
        """Return the quantity and its column, of an equation between both."""
        columns = [head.name for head in self.heads]
        whole = _IN_BRACKETS.fullmatch(right)
        for term, unit in ((right, ""), (whole[1], whole[2]) if whole else ("", "")):
            if left in self.targets and (found := _term(term, columns)):
                name, sign, offset = found
                use = Use(self._column(name), self.targets[left], unit, sign, offset)
                return left, use
            if left in columns and (found := _term(term, self.targets)):
                name, sign, offset = found
                use = Use(self._column(left), self.targets[name], unit, sign, -sign * offset)
                return name, use
        if left in columns:
            raise unknown_name(self.file, MAP, right, self.targets, "a quantity of the case")
        if left in self.targets:
            raise unknown_name(self.file, MAP, right, columns, "a column of the file")
        known = [*self.targets, *(body.name for body in self.case.mechanism.moving), *columns]
        raise unknown_name(self.file, MAP, left, known, f"a quantity, body or column. {FORM}")

    def _column(self, name: str, prefix: str = "") -> int:
        """Return the index of the only column of a name, below a prefix if one is given."""
        names = [f"{prefix}{between}{name}" for between in (".", "_", " ", "")] if prefix else []
        for each in (*names, name):
            places = [k for k, head in enumerate(self.heads) if head.name == each]
            if len(places) == 1:
                return places[0]
            if places:
                raise self._fault(f"found several columns {shown(each)}, expected one. Rename one")
        known = [head.name for head in self.heads]
        wanted = names[0] if names else name
        raise unknown_name(self.file, MAP, wanted, known, "a column of the file")

    def _pose(self, text: str) -> Pose:
        prefix, colon, rest = text.partition(":")
        groups = dict[str, tuple[Use, ...]]()
        reading, turned = Reading("123"), list[str]()
        frame: tuple[float, ...] | None = ()
        for part in (rest if colon else text).split(","):
            whole = _IN_BRACKETS.fullmatch(part.strip())
            words, unit = (whole[1], whole[2]) if whole else (part, "")
            key, *names = words.split() or [""]
            if key == "first" and not names:
                frame = None
                continue
            if key == "frame":
                frame = self._frame(names)
                continue
            what, si, counts = key, _UNITS.get(key, "m"), [3]
            if key in ("euler", "quaternion"):
                reading, names = self._reading(key, names)
                what, si, counts = "attitude", *(("rad", [3]) if reading.angles else ("1", [4]))
            elif key in _OF_MOTION:
                turned += [key] * ("body" in names)
                names, counts = [name for name in names if name != "body"], [1, 2, 3]
            elif key != "position":
                what, names = "position", [key, *names]
            if len(names) not in counts or what in groups:
                problem = f"found {shown(part.strip())}, expected {counts[-1]} columns of {what}"
                raise self._fault(f"{problem}, once. {FORM}")
            named = (self._column(name, prefix.strip() if colon else "") for name in names)
            groups[what] = tuple(Use(k, si, unit) for k in named)
        planar = "attitude" not in groups and self._is_planar(groups.get("position", ()))
        if planar:
            reading = Reading(PLANE)
            for place, turn in _PLANAR.items():
                if turn not in groups and self._is_planar(groups.get(place, ())):
                    groups |= _split(groups, place, turn)
        for what, uses in groups.items():
            counts = [1, 3] if planar and what in _PLANAR.values() else [2, 3] if planar else [3]
            if what in _OF_MOTION and len(uses) not in counts:
                problem = f"found {len(uses)} columns of {what}, expected {counts[0]}"
                raise self._fault(f"{problem} of {'a planar' if planar else 'this'} pose. {FORM}")
        lacking = [each for each in ("position", "attitude") if each not in groups]
        lacking += [b for a, b in _NEEDS if a in groups and b not in groups]
        if lacking:
            problem = f"found {shown(text)} without {' and '.join(lacking)}, expected them"
            raise self._fault(f"{problem}. {FORM}")
        return Pose(groups, reading, tuple(turned), frame)

    def _is_planar(self, position: Sequence[Use]) -> bool:
        """Return whether the third of three columns is an angle or its rate, by its unit or else
        its name.
        """
        if len(position) < 3:
            return False
        head, stated = self.heads[position[2].column], position[2].unit
        if unit := head.unit or (stated if _turns(stated) else ""):
            return _turns(unit)
        return not _UPWARDS.fullmatch(re.split(r"[._ ]", head.name.lower())[-1])

    def _reading(self, key: str, words: Sequence[str]) -> tuple[Reading, list[str]]:
        """Return the reading of words, and the words after it."""
        order, *names = ("".join(_AXES.get(x, x) for x in words[0]) if words else "", *words[1:])
        order = order if key == "euler" else "".join(words[:1])
        known = SEQUENCES if key == "euler" else ORDERS
        require_known(self.file, MAP, order, known, f"{key} {' or '.join(known)}")
        flags = ("fixed", "inverted") if key == "euler" else ("inverted",)
        stated = {word: word in names for word in flags}
        return Reading(order, **stated), [name for name in names if name not in flags]

    def _frame(self, words: Sequence[str]) -> tuple[float, ...]:
        """Return origin and Euler parameters of a recorded frame at design."""
        try:
            found = tuple(map(decimal, words))
        except ValueError:
            found = ()
        if len(found) != 7 or not any(found[3:]):
            expected = "x y z [m] and Euler parameters e0 e1 e2 e3, global, at design"
            raise self._fault(f"found frame {shown(' '.join(words))}, expected {expected}")
        return found

    def _poses_by_name(self, prefixes: Mapping[str, str]) -> Iterator[tuple[str, Pose]]:
        """Yield the poses of columns by their names: of Adams, or PREFIX.x, .y, .z with the
        parts of a quaternion; the prefix of a body is its name, or that of --map.
        """
        places = {head.name: k for k, head in enumerate(self.heads)}
        for name, prefix in prefixes.items():
            own = {
                head.name.rpartition(".")[2]: k
                for k, head in enumerate(self.heads)
                if prefix in head.part
            }
            if {*own}.issuperset((*_ADAMS["position"], *_ADAMS["attitude"])):
                groups = {
                    what: tuple(Use(own[n], _UNITS[what]) for n in names)
                    for what, names in _ADAMS.items()
                    if {*own}.issuperset(names)
                }
                yield name, Pose(groups, Reading("313"))
                continue
            for order, parts in _QUATERNIONS.items():
                names = [f"{prefix}.{each}" for each in ("x", "y", "z", *parts)]
                if {*places}.issuperset(names) and not {*self.targets}.intersection(names):
                    uses = [Use(places[n], si) for n, si in zip(names, "mmm1111", strict=True)]
                    groups = {"position": (*uses[:3],), "attitude": (*uses[3:],)}
                    yield name, Pose(groups, Reading(order))


def _turns(unit: str) -> bool:
    """Return whether a unit is one of angles, or of their rates."""
    whole = unit.lower().partition("/")[0]
    return UNIT_NAMES.get(whole, whole) in (*ANGLES, "mrad")


def _split(
    groups: Mapping[str, tuple[Use, ...]], place: str, turn: str
) -> dict[str, tuple[Use, ...]]:
    """Return two columns of a place or its rate in the plane, and the third, of the angle."""
    *along, angle = groups[place]
    turns = _turns(angle.unit)
    return {
        place: tuple(replace(use, unit="" if turns else use.unit) for use in along),
        turn: (replace(angle, si=_UNITS[turn], unit=angle.unit if turns else ""),),
    }


def _normal(name: str) -> str:
    """Return a name without differences in capitals and separators."""
    return re.sub(r"[^a-z0-9.]+", "_", name.lower()).strip("_")


def _term(text: str, known: Collection[str]) -> tuple[str, float, float] | None:
    """Return name, sign and offset of "[-]NAME[+-NUMBER]"; None if it is none of a known name."""
    sign = -1.0 if text.startswith("-") and text not in known else 1.0
    text = text if text in known else text.lstrip("+-").strip()
    if text in known:
        return text, sign, 0.0
    for place in [each.start() for each in re.finditer(r"[+-]", text)]:
        name, number = text[:place].strip(), text[place:].replace(" ", "")
        offset = number_or_nan(number)
        if name in known and abs(offset) < float("inf"):
            return name, sign, offset
    return None


def unit_of(file: Path, head: Head, use: Use, angle: str = "") -> tuple[str, float, float]:
    """Return the unit of a column and its size in SI, and the offset in SI.

    A stated unit is that of the offset, and of a column without one; without an offset it replaces
    the column's.

    Args:
        angle: unit of angles without one.

    Raises:
        CaseError: a unit is unknown, or of something else.
    """

    def size_of(unit: str) -> float:
        return require_unit(file, "", head.name, unit, use.si).convert(1.0)

    own = head.unit or use.si.replace("rad", angle or "rad")
    stated = use.unit or own
    unit = own if head.unit and use.offset else stated
    return unit, size_of(unit), use.offset * size_of(stated)


def si_values(recording: Recording, use: Use) -> Column:
    """Return a column as its quantity, in SI; see `unit_of`."""
    column = recording.columns[use.column]
    _, size, offset = unit_of(recording.file, column.head, use, recording.angle)
    values = use.sign * size * column.values + offset
    return Column(column.head, values, column.half * abs(use.sign) * size)


@dataclass(frozen=True)
class Accuracy:
    """Accuracies by quantity (position, velocity, acceleration) or output.

    Attributes:
        shares: parts of the largest value.
        sizes: in SI.
    """

    shares: Mapping[str, float] = field(default_factory=dict[str, float])
    sizes: Mapping[str, float] = field(default_factory=dict[str, float])

    def of_rows(self, quantity: str, largest: float) -> float:
        """Return the accuracy of a quantity of bodies [m, m/s or m/s^2]."""
        return self.shares.get(quantity, 0.0) * largest + self.sizes.get(quantity, 0.0)

    def of_output(self, output: Quantity, quantity: str, values: Array) -> float:
        """Return the accuracy of an output with these values [unit, per s or s^2]."""
        largest = float(np.abs(np.nan_to_num(values)).max(initial=0.0))
        own = output.name if quantity == "position" else f"{output.name}.{quantity}"
        shares = max(self.shares.get(own, 0.0), self.shares.get(quantity, 0.0))
        size = self.sizes.get(quantity, 0.0) if output.unit == "m" else 0.0
        return shares * largest + max(self.sizes.get(own, 0.0), size)


def read_accuracy(file: Path, case: Case, texts: Sequence[str]) -> Accuracy:
    """Return the accuracies of texts "NAME=NUMBER [UNIT]".

    Raises:
        CaseError: a text has another form, or names neither a quantity nor an output.
    """
    units = known_columns(case.outputs) | _ROW_UNITS
    shares = dict[str, float]()
    sizes = dict[str, float]()
    for text in texts:
        name, _, right = (part.strip() for part in text.partition("="))
        expected = f"{', '.join(QUANTITIES)} or an output"
        require_known(file, ACCURACY, name, units, expected)
        number, _, unit = right.partition(" ")
        found = number_or_nan(number)
        if not 0.0 < found < float("inf"):
            raise fault(
                file, ACCURACY, f"found {shown(text)}, expected a positive number. {ACCURACY_FORM}"
            )
        if unit.strip():
            sizes[name] = require_unit(file, ACCURACY, name, unit.strip(), units[name]).convert(
                found
            )
        else:
            shares[name] = found
    return Accuracy(shares, sizes)
