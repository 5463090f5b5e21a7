"""The language of MJCF: its attributes, default classes, settings of the compiler, orientations,
included files and copies.

The attributes are those of MuJoCo's own schema (mj_printSchema, MuJoCo 4.0).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os.path import isfile
from pathlib import Path

from ...algebra import IDENTITY, ZERO, Quat, cross, quat, vec
from ...case.io.document import read_text, shown
from ...case.io.readers import LARGEST_FILE
from ..xml.element import MOST_ELEMENTS, ZEROS, Apart, Element, file_near, parse_xml, words
from ..xml.ledger import Asked
from .place import AXES, Place, euler_turn, turn_about, turn_of_axes, turn_to, unit_quaternion

ORIENTATION = words("quat axisangle xyaxes zaxis euler")
_FRAME = ("name", "childclass", "pos", *ORIENTATION)
_SOFT = words("solref solimp class active name")
_FORCES = words("springdamper springyield stiffness springref armature damping frictionloss")
_LIMITS = words(
    "range limited actuatorfrcrange actuatorfrclimited actuatorgravcomp margin "
    "solreflimit solimplimit"
)
_JOINT = (*_FORCES, *_LIMITS, *words("type group pos axis ref user solreffriction solimpfriction"))

_COMPILER = words(
    "alignfree angle assetdir autolimits balanceinertia boundinertia boundmass conflict "
    "coordinate discardvisual eulerseq fitaabb fusestatic inertiafromgeom "
    "inertiagrouprange meshdir passthrough savecanonical savecompiled saveinertial "
    "settotalmass strippath texturedir usethread"
)

KNOWN = {
    "compiler": _COMPILER,
    "worldbody": (),
    "body": (*_FRAME, *words("mocap gravcomp user sleep fuse simple")),
    "frame": _FRAME,
    "replicate": words("count sep offset euler childclass"),
    "key": words("name time qpos qvel act mpos mquat ctrl plastic"),
    "joint": ("name", "class", *_JOINT),
    "freejoint": ("name", "group", "align"),
    "site": (*ORIENTATION, *words("name class type group pos material mesh size fromto rgba user")),
    "connect": (*_SOFT, *words("body1 body2 anchor site1 site2")),
    "weld": (*_SOFT, *words("body1 body2 relpose anchor torquescale site1 site2")),
    "equality joint": (*_SOFT, "joint1", "joint2", "polycoef"),
    "equality tendon": (*_SOFT, "tendon1", "tendon2", "polycoef"),
    "default equality": _SOFT,
    "inertial": ("pos", "mass", "diaginertia", "fullinertia", *ORIENTATION),
    "spatial site": ("site",),
    "spatial geom": ("geom", "sidesite"),
    "pulley": ("divisor",),
    "fixed joint": ("joint", "coef"),
}
_TENDON = (
    *words("name class group limited range actuatorfrclimited actuatorfrcrange solreflimit"),
    *words("solimplimit solreffriction solimpfriction margin material rgba width user"),
    *words("frictionloss springlength springyield stiffness damping armature"),
)
_OPEN = {
    "geom": (
        *ORIENTATION,
        *words("name class type size fromto pos mass density group shellinertia mesh"),
    ),
    "option": (
        *words("actuatorgroupdisable ccd_iterations ccd_tolerance cone density gravity impratio"),
        *words("integrator iterations jacobian ls_iterations ls_tolerance magnetic"),
        *words("noslip_iterations noslip_tolerance o_friction o_margin o_solimp o_solref"),
        *words("sdf_initpoints sdf_iterations sleep_tolerance solver timestep tolerance viscosity"),
        *words("wind mpr_iterations mpr_tolerance apirate collision"),
    ),
    "flag": (
        *words("actuation autoreset clampctrl constraint contact damper diagexact energy equality"),
        *words("eulerdamp filterparent frictionloss fwdinv gravity invdiscrete ipc island limit"),
        *words("midphase multiccd nativeccd override refsafe sensor sleep speculative spring"),
        *words("warmstart passive"),
    ),
    **dict.fromkeys(("spatial", "fixed", "default tendon"), _TENDON),
}
"""Attributes of elements with many others, and more in other releases of MuJoCo."""
_ALL = KNOWN | _OPEN

_READ = words("compiler option default worldbody tendon equality")
_NOT_READ = words(
    "size statistic visual extension asset deformable contact actuator sensor custom keyframe"
)
ROOT = (*_READ, *_NOT_READ)
"""Sections of <mujoco>: read ones, and others."""

IN_BODY = words("body frame joint freejoint site inertial geom camera light plugin")
"""Elements of a body, besides those of new bodies."""

MAKE_BODIES = {
    "composite": "it makes bodies",
    "flexcomp": "it makes bodies",
    "attach": "it takes bodies from another model",
}
"""Elements in place of others, not read; MuJoCo itself can write the model out."""

EXPANDED = ("include", "replicate")
"""Elements in place of others, read; see `expand`."""

WRITE_OUT = (
    'let MuJoCo write the model out and give that file: python -c "import mujoco;'
    " mujoco.mj_saveLastXML('flat.xml', mujoco.MjModel.from_xml_path('model.xml'))\""
)

APART = Apart(
    "MJCF",
    {
        "": words("name class childclass user group material rgba"),
        "mujoco": words("model <size> <statistic> <visual>"),
        "compiler": (
            *words("assetdir conflict discardvisual fitaabb fusestatic meshdir passthrough"),
            *words("savecanonical savecompiled saveinertial strippath texturedir usethread"),
            "<lengthrange>",
        ),
        "option": _OPEN["option"],
        "flag": _OPEN["flag"],
        "default": words(
            "<mesh> <texture> <material> <camera> <light> <pair> <general> <motor> <position>"
            " <velocity> <intvelocity> <orientation> <pid> <damper> <cylinder> <muscle> <adhesion>"
            " <dcmotor>"
        ),
        "body": words("mocap gravcomp sleep fuse simple"),
        "joint": words(
            "springyield armature frictionloss actuatorgravcomp margin solreflimit solimplimit"
            " solreffriction solimpfriction"
        ),
        "site": words("type size mesh"),
        **dict.fromkeys(
            (
                *("connect", "weld", "equality joint", "equality tendon", "equality"),
                "default equality",
            ),
            (*_SOFT, "anchor"),
        ),
        **dict.fromkeys(("spatial", "fixed", "tendon", "default tendon"), _TENDON),
    },
    extended=("option", "flag"),
)
"""Names of MJCF without meaning for kinematics."""

DYNAMIC = {
    "range": "ranges",
    "armature": "armature",
    "frictionloss": "friction",
}
"""Attributes of joints without effect on a given motion; they are counted for the list of parts
left out.
"""


def require_known_attributes(root: Element) -> None:
    """Refuse attributes unknown to MJCF, for a mistyped one would silently be its default.

    Raises:
        CaseError: there is one.
    """
    waiting = [(root.tag, each) for each in root.findall(*_READ, "keyframe")]
    while waiting:
        around, element = waiting.pop()
        inner = f"{around} {element.tag}"
        key = inner if inner in _ALL else element.tag
        if key in _ALL:
            element.require_known(_ALL[key], closed=key in KNOWN)
        if element.tag not in MAKE_BODIES:
            waiting += [(element.tag, child) for child in reversed(element.children)]


MAIN = "main"
_IN_CLASSES = words("joint site equality geom tendon")


class Classes:
    """Default classes of a model: attributes of elements beyond their own.

    Raises:
        CaseError: one has no name inside another, or one is given twice.
    """

    def __init__(self, root: Element) -> None:
        self._attributes: dict[str, dict[str, dict[str, str]]] = {MAIN: {}}
        self._defaults: list[Element] = []
        self._asked: dict[str, list[set[str]]] = {}
        for top in root.findall("default"):
            top.choice("class", (MAIN,), MAIN)
            waiting = [(top, MAIN, MAIN)]
            while waiting:
                element, name, around = waiting.pop()
                if element is not top and (not name or name in self._attributes):
                    problem = f"found {shown(name)} again" if name else "missing"
                    raise element.fault(
                        f"class: {problem}, expected a name of its own; name the class"
                    )
                own = {kind: dict(values) for kind, values in self._attributes[around].items()}
                for child in element.findall(*_IN_CLASSES):
                    own[child.tag] = _merged(own.get(child.tag, {}), child.attributes)
                    self._defaults.append(child)
                self._attributes[name] = own
                inner = [*element.findall("default")][::-1]
                waiting += [(each, each.attributes.get("class", ""), name) for each in inner]

    def complete(self, element: Element, kind: str, childclass: str = MAIN) -> Element:
        """Return the element with the attributes of its class, or of the class of the body around
        it, added if it has none.
        """
        name = element.attributes.get("class", childclass)
        if name not in self._attributes:
            raise element.unknown_name("class", name, self._attributes, "a default class")
        found = _merged(self._attributes[name].get(kind, {}), element.attributes)
        self._asked.setdefault(kind, []).append(element.asked)
        return replace(element, attributes=Asked(found, element.asked))

    def take(self) -> None:
        """Mark the questions to elements of a kind in its defaults; those of no element
        have no meaning.
        """
        for default in self._defaults:
            asked = self._asked.get(default.tag)
            if asked and default.tag != "geom":  # geoms are listed, and read for masses alone
                default.take(*set[str]().union(*asked))
            else:
                default.leave()


def _merged(inherited: Mapping[str, str], own: Mapping[str, str]) -> dict[str, str]:
    """Return attributes, the own ones first; an orientation takes the place of another, however
    either is written.
    """
    turned = ORIENTATION if any(key in own for key in ORIENTATION) else ()
    return {**{key: value for key, value in inherited.items() if key not in turned}, **own}


@dataclass(frozen=True)
class Compiler:
    """How a model writes its angles, and how its masses are taken.

    Attributes:
        degrees: angles are in degrees, as they are unless the model says otherwise.
        sequence: three letters, the axes of Euler angles: small ones turn with the body, capital
            ones stand still.
        align: the frames of free bodies are moved to their inertia, unless a joint says otherwise.
        from_geoms: "true", "false", or "auto" for bodies without <inertial>.
        groups: first and last group of geoms with a mass.
        least: lower bounds of mass and principal moments [kg, kg m^2].
        balanced: principal moments that break the triangle inequality become their mean.
        total: mass of the whole model [kg]; negative for no such rule.
        limited: a joint with a range is limited, unless it says otherwise.
    """

    degrees: bool = True
    sequence: str = "xyz"
    align: bool = False
    from_geoms: str = "auto"
    groups: tuple[float, float] = (0.0, 5.0)
    least: tuple[float, float] = (0.0, 0.0)
    balanced: bool = False
    total: float = -1.0
    limited: bool = True

    def angle(self, value: float) -> float:
        """Return an angle of the file [rad]."""
        return math.radians(value) if self.degrees else value

    def euler(self, angles: Sequence[float]) -> Quat:
        """Return the turn of three Euler angles as the model writes them."""
        return euler_turn(self.sequence, map(self.angle, angles))

    def place(self, element: Element) -> Place:
        """Return the place given by pos and one kind of orientation.

        Raises:
            CaseError: several orientations, or a meaningless one: zero or parallel axes, a zero
                quaternion.
        """
        if (
            "fromto" in element.attributes
        ):  # of a site; its z axis goes from the second to the first
            numbers = element.numbers("fromto", 6)
            first, second = vec(numbers[:3]), vec(numbers[3:])
            element.asked.update(("pos", *ORIENTATION))  # without effect beside it
            axis = element.direction((*(first - second),), "fromto")
            return Place(0.5 * (first + second), turn_to(axis))
        at = vec(element.numbers("pos", 3, default=ZEROS))
        given = [name for name in ORIENTATION if name in element.attributes]
        if len(given) > 1:
            raise element.fault(
                f"found {' and '.join(given)}, expected one orientation; remove the others"
            )
        return Place(at, self._turn(element, given[0]) if given else IDENTITY)

    def _turn(self, element: Element, name: str) -> Quat:
        count = {"quat": 4, "axisangle": 4, "xyaxes": 6}.get(name, 3)
        numbers = element.numbers(name, count)
        match name:
            case "euler":
                return self.euler(numbers)
            case "quat":
                element.require_nonzero(numbers, name)
                return unit_quaternion(quat(numbers))
            case "axisangle":
                axis = element.direction(numbers[:3], name)
                return turn_about(axis, self.angle(numbers[3]))
            case "zaxis":
                return turn_to(element.direction(numbers, name))
            case _:
                x, y = element.direction(numbers[:3], name), vec(numbers[3:])
                y = element.direction((*(y - (x @ y) * x),), name)
                return turn_of_axes(x, y, cross(x, y))


def read_compiler(root: Element) -> Compiler:
    """Return the settings of all <compiler> elements, the last of which counts.

    Raises:
        CaseError: an unknown setting, or global coordinates, which MuJoCo does not read any more.
    """
    found = Compiler()
    for element in root.findall("compiler"):
        element.require_known(KNOWN["compiler"])
        degrees = element.choice("angle", ("degree", "radian"), _ANGLES[found.degrees])
        sequence = element.attributes.get("eulerseq", found.sequence)
        if len(sequence) != 3 or not all(letter.lower() in AXES for letter in sequence):
            raise element.fault(
                f"eulerseq: found {shown(sequence)}, expected three of x, y, z, X, Y, Z; correct it"
            )
        if element.attributes.get("coordinate") == "global":
            raise element.fault(
                "coordinate: found 'global', which MuJoCo does not read any more (since 2.3.4),"
                " expected local coordinates; convert the model by MuJoCo 2.3.3 or older, whose"
                " mj_saveLastXML writes local ones, and give that file"
            )
        element.choice("coordinate", ("local",), "local")
        first, last = element.numbers("inertiagrouprange", 2, default=found.groups)
        mass, moment = found.least
        found = Compiler(
            degrees == "degree",
            sequence,
            element.flag("alignfree", default=found.align),
            element.choice("inertiafromgeom", ("true", "false", "auto"), found.from_geoms),
            (first, last),
            (element.number("boundmass", mass), element.number("boundinertia", moment)),
            element.flag("balanceinertia", default=found.balanced),
            element.number("settotalmass", found.total),
            element.flag("autolimits", default=found.limited),
        )
    return found


_ANGLES = {True: "degree", False: "radian"}
_MODELS = (".xml", ".mjcf")
MOST_INCLUDES, MOST_COPIES = 100, 1_000


@dataclass
class _Expansion:
    """The elements of a model of several files.

    Attributes:
        root: file of the model; includes are in the folder around its own one, or below.
        compiler: how the model writes angles; without it, copies are not made yet.
        taken: included files; each may be included once.
        bytes: how many were read.
        elements: how many there are.
    """

    root: Path
    compiler: Compiler | None = None
    taken: set[Path] = field(default_factory=set[Path])
    bytes: int = 0
    elements: int = 0

    def expand(self, around: Element) -> Element:
        """Return an element with all in it expanded, at any depth."""
        return around.rebuild(self._expand)

    def _expand(self, element: Element) -> Iterator[Element]:
        """Yield what an element stands for, whose content is expanded."""
        self.elements += 1
        if self.elements > MOST_ELEMENTS:
            raise element.too_many()
        if element.tag == "include":
            yield from self.expand(self._include(element)).children
        elif element.tag == "replicate" and self.compiler is not None:
            yield from self._copies(element, element.children, self.compiler)
        else:
            yield element

    def _include(self, element: Element) -> Element:
        element.require_known(("file",))
        name = element.attributes.get("file", "")
        file = file_near(self.root.parent.resolve(), name, _MODELS)
        problem = ""
        if file is None:
            problem = (
                f"found {shown(name)}, expected a file in the folder of the model, in one beside it"
                f" or below, and no other is opened; put it there, or {WRITE_OUT}"
            )
        elif file in self.taken:
            problem = f"found {shown(name)} again, and MuJoCo includes each file once; remove it"
        elif len(self.taken) == MOST_INCLUDES:
            problem = f"found more than {MOST_INCLUDES} includes, expected fewer; {WRITE_OUT}"
        elif not isfile(file):
            problem = f"found {shown(name)}, but there is no such file; check it"
        if problem or file is None:
            raise element.fault(f"file: {problem}")
        self.taken.add(file)
        text = read_text(file, LARGEST_FILE - self.bytes, "take out what is not the mechanism")
        self.bytes += len(text)
        return parse_xml(file, text)

    def _copies(
        self, element: Element, inside: Sequence[Element], compiler: Compiler
    ) -> Iterator[Element]:
        """Yield the copies in frames, with names of their own.

        Each is at the offset from the one before, in that one's axes; its Euler angles are as many
        times the given ones as there are copies before it (measured: MuJoCo 4.0).
        """
        element.require_known(KNOWN["replicate"])
        text = element.attributes.get("count", "")
        if not (text.isascii() and text.isdigit() and 0 < int(text[:9]) <= MOST_COPIES):
            raise element.fault(
                f"count: found {shown(text)}, expected a number of copies, 1 to {MOST_COPIES};"
                " correct it"
            )
        count, separator = int(text), element.attributes.get("sep", "")
        offset = vec(element.numbers("offset", 3, default=ZEROS))
        turn = element.numbers("euler", 3, default=ZEROS)
        self.elements += count * sum(1 + sum(1 for _ in each.descendants()) for each in inside)
        if self.elements > MOST_ELEMENTS:
            raise element.fault(f"makes more than {MOST_ELEMENTS} elements; lower its count")
        digits, at = len(str(count - 1)), ZERO
        own = {key: text for key, text in element.attributes.items() if key == "childclass"}
        for k in range(count):
            place = Place(at, compiler.euler([k * angle for angle in turn]))
            renamed = [_with_suffix(each, f"{separator}{k:0{digits}}") for each in inside]
            attributes = {"pos": _text(place.at), "quat": _text(place.turn), **own}
            yield replace(element, tag="frame", attributes=attributes, children=renamed)
            at = place.point(offset)


def _text(values: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in values)


def _with_suffix(element: Element, suffix: str) -> Element:
    def renamed(each: Element) -> Element:
        own = each.attributes
        return (
            replace(each, attributes={**own, "name": own["name"] + suffix})
            if own.get("name")
            else each
        )

    return renamed(element.rebuild(lambda each: (renamed(each),)))


def expand(root: Element) -> Element:
    """Return the model without includes and replicates.

    Raises:
        CaseError: a file is missing, elsewhere or taken twice, a replicate or a setting of the
            compiler makes no sense, or there is too much of either.
    """
    file = root.file.resolve()
    whole = _Expansion(file).expand(root)
    return _Expansion(file, read_compiler(whole)).expand(whole)
