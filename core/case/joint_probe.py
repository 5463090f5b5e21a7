"""Joint probes: one small closed-loop case for any type of joint or coupler, from the class alone.

A driven hinge joins body a to the ground. The joint under test carries body b on body a. One rod
for each freedom of the joint ties b to the ground, so every freedom moves, and the joint alone
moves it. A coupler sits between two joints of a: a rod to the ground moves the first, and the
coupler moves the second.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, Field, fields, replace
from itertools import combinations
from typing import Any, TypeVar

import numpy as np

from ..errors import MechanismError
from ..joints import AxialJoint, Coupler, Distance, Joint, Kind, Revolute, Translational
from ..mechanism.mechanism import GROUND, Body, Mechanism, Point, Vector
from ..mechanism.motions import JointAngle
from .case import Case, Output, Sweep, Truth
from .quantity import AXES

# Design position: skew axes and uneven numbers, so no row vanishes by symmetry. Global, in metres.
HINGE = Revolute("hinge", GROUND, "a", (0.1, -0.2, 0.3), (1.0, 2.0, 2.0))
POINT: Vector = (0.2, -0.1, 0.2)
LINK: Vector = (0.33, -0.18, 0.34)
AXIS: Vector = (2.0, -1.0, 2.0)
LENGTH = 0.05
NUMBER = 1.5

# A perpendicular pair, and one 40 degrees apart for joints whose shafts must point in one
# direction.
_H, _F = np.array(AXIS) / 3.0, np.array([1.0, 4.0, 1.0]) / math.sqrt(18.0)
PAIRS = tuple(
    (
        AXIS,
        tuple(
            (math.cos(math.radians(degrees)) * _H + math.sin(math.radians(degrees)) * _F).tolist()
        ),
    )
    for degrees in (90, 40)
)

# Ends on b and on the ground. Drawn at random and selected: for each number of rods that a built-in
# joint needs, the mechanism stays far from lock-up over the sweep and every freedom moves.
RODS: Sequence[tuple[Vector, Vector]] = (
    ((0.49, 0.09, 0.28), (0.8, -0.47, 0.26)),
    ((0.06, -0.32, 0.56), (1.02, -0.46, 0.73)),
    ((0.55, 0.24, 0.51), (0.4, -0.62, 1.12)),
    ((0.12, -0.21, 0.36), (-0.22, -0.1, 1.22)),
    ((0.43, -0.42, 0.1), (-0.03, -0.81, 0.14)),
    ((0.4, 0.1, 0.0), (0.9, 0.6, -0.2)),
)
TIPS: Sequence[Vector] = ((0.35, -0.05, 0.4), (0.1, 0.15, 0.15))

TURN = np.linspace(-0.4, 0.4, 41)
"""Angle of the hinge [rad], at 1 rad/s."""

# Residuals of 1e-12 of a metre-sized mechanism, times the condition of its rows (at most a hundred,
# by sigma), times ten.
ATOL = 1e-9
WHY = (
    "residual tolerance 1e-12 over the smallest singular value of a built-in joint's probe"
    " (0.01), x10"
)

CURVE = (0.0, NUMBER, 0.25, -0.125, 0.0625)
LISTS: Mapping[Any, Any] = {
    "tuple[float, ...]": CURVE,
    tuple[float, ...]: CURVE,
    "tuple[tuple[float, float], ...]": tuple(
        (x, sum(c * x**k for k, c in enumerate(CURVE))) for x in (-1.5, -0.7, -0.2, 0.0, 0.4, 1.1)
    ),
}
"""Values of fields that are lists, by their annotation: coefficients of a polynomial whose slope
vanishes nowhere near the design, and points on it.
"""

_Tested = TypeVar("_Tested", bound=Joint | Coupler)


def probe(tested: Joint | Coupler | type[Joint] | type[Coupler]) -> Case:
    """Return the closed-loop case of a joint, of a coupler, or of a specimen of their type.

    Args:
        tested: its geometry is kept; its bodies or joints are replaced by those of the probe.

    Raises:
        MechanismError: no specimen of the type can be built.
    """
    return next(alternatives(tested))


def alternatives(tested: Joint | Coupler | type[Joint] | type[Coupler]) -> Iterator[Case]:
    """Yield the probe with each choice of rods, the preferred one first. Another choice may not
    lock the joint if the first does.
    """
    one = specimen(tested) if isinstance(tested, type) else tested
    return _of_joint(one) if isinstance(one, Joint) else iter([_of_coupler(one)])


def probes() -> list[Case]:
    """Return a probe of each registered type: joints, then couplers, each sorted by name."""
    registries: Sequence[Mapping[str, type[Joint | Coupler]]] = (Joint.registry, Coupler.registry)
    return [probe(registry[name]) for registry in registries for name in sorted(registry)]


def specimen(of: type[_Tested]) -> _Tested:
    """Return an instance between bodies a and b (a coupler: between joints first and second), with
    geometry from the kinds of its fields.

    Fields with a default keep it; numbers without a kind are ratios.

    Raises:
        MechanismError: the class rejects both pairs of directions, or has a field of unknown kind.
    """
    between: dict[str, Any] = (
        {"i": "a", "j": "b"} if issubclass(of, Joint) else {"joints": ("first", "second")}
    )
    if issubclass(of, Coupler) and of.count is None:  # a list for as many joints
        between["factors"] = (1.0, NUMBER)
    try:
        return make_fitting(of, {"name": "tested", **between}, map(_maker_of_pair, PAIRS))
    except MechanismError as refused:
        raise MechanismError(
            f"{of.__name__}: no specimen can be made, it refuses axes at right angles and at 40"
            f" degrees; the last refusal: {refused}"
        ) from refused


def make_fitting(
    of: type[_Tested], given: Mapping[str, Any], makers: Iterable[Callable[[Field[Any]], Any]]
) -> _Tested:
    """Return an instance with the given fields, and the other required ones by the first maker
    whose values it accepts.

    Raises:
        MechanismError: the last refusal, if it accepts none.
    """
    refused: MechanismError | None = None
    for make in makers:
        values = {each.name: make(each) for each in required_fields(of) if each.name not in given}
        try:
            return of(**given, **values)
        except MechanismError as error:
            refused = error
    assert refused is not None
    raise refused


def required_fields(of: type[Joint] | type[Coupler]) -> list[Field[Any]]:
    """Return the fields without a default."""
    return [
        each for each in fields(of) if each.default is MISSING and each.default_factory is MISSING
    ]


def _maker_of_pair(pair: Any) -> Callable[[Field[Any]], Any]:
    values = {
        Kind.POSITION: POINT,
        Kind.POSITIONS: (POINT, LINK),
        Kind.DIRECTION: AXIS,
        Kind.DIRECTIONS: pair,
        Kind.LENGTH: LENGTH,
        None: NUMBER,
    }
    return lambda each: LISTS.get(each.type) or values[each.metadata.get("kind")]


def _of_joint(joint: Joint) -> Iterator[Case]:
    freedoms = 6 - joint.rows
    if freedoms > len(RODS):
        raise MechanismError(
            f"{joint}: has {joint.rows} rows, expected one or more; return its primitives"
        )
    for rods in combinations(range(len(RODS)), freedoms):
        yield _case(joint.type, [replace(joint, i="a", j="b")], _rods(rods))


def _of_coupler(coupler: Coupler) -> Case:
    kinds: dict[str, type[AxialJoint]] = {"rotation": Revolute, "translation": Translational}
    first, second = (kinds[freedom] for freedom in coupler.freedoms)
    joints = [first("first", "a", "b", POINT, AXIS), second("second", "a", "c", LINK, PAIRS[0][1])]
    return _case(coupler.type, joints, _rods([0]), [replace(coupler, joints=("first", "second"))])


def _rods(chosen: Sequence[int]) -> list[Joint]:
    return [Distance(f"rod_{k + 1}", "b", GROUND, RODS[k]) for k in chosen]


def _case(
    type_: str, tested: Sequence[Joint], rods: Sequence[Joint], couplers: Sequence[Coupler] = ()
) -> Case:
    last = tested[-1].j
    mechanism = Mechanism(
        type_,
        bodies=[Body("a"), *(Body(joint.j) for joint in tested)],
        joints=[HINGE, *tested, *rods],
        points=[Point(f"tip_{k}", last, position) for k, position in enumerate(TIPS, 1)],
        drivers=[JointAngle("turn", "hinge")],
        couplers=couplers,
    )
    source = (
        f"probe of the {type_.replace('_', ' ')} joint: its geometry, a driven hinge, and rods at"
        " fixed positions"
    )
    return Case(
        type_, source, Truth.CONSENSUS_ONLY, mechanism, Sweep("turn", TURN), coordinates(mechanism)
    )


def coordinates(mechanism: Mechanism) -> tuple[Output, ...]:
    """Return the coordinates of all points as outputs."""
    return tuple(
        Output(f"{point.name}_{axis}", point.name, direction, False, ATOL, 0.0, WHY)
        for point in mechanism.points
        for axis, direction in AXES.items()
    )
