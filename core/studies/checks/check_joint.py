"""Examination of a Joint class, without knowledge of its meaning.

    from kincheck.core import check_joint

    def test_my_joint():
        report = check_joint(MyJoint)
        assert report.passed, report

Each check is a row of the report: the worst number found, the limit with its reason, the place. A
check that cannot run is a row too. A class may offer two methods of its own:

    @classmethod
    def specimens(cls) -> list[Self]
        joints to examine, if random geometry by the kinds of the fields does not fit
    def equivalent(self) -> tuple[list[Body], list[Joint]]
        further bodies and known joints with the same effect between self.i and self.j;
        simulators that do not know the joint are compared on them
"""

from __future__ import annotations

import math
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import Field, is_dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...algebra import triple
from ...case.joint_probe import make_fitting, required_fields
from ...errors import KincheckError, MechanismError
from ...harness.engine import Engine
from ...joints import Joint, Kind
from ...trajectory import Array
from .findings import Finding, Report, Verdict, fault_finding, skip, worst
from .joint_equations import (
    axis_lengths,
    composition,
    convergence,
    cost,
    derivatives,
    driver,
    exchange,
    freedoms,
    intended_branch,
    named_coordinates,
    right_sides,
    rigid_motion,
    round_off,
    size_and_place,
)
from .joint_loops import loops
from .manifold import Specimen, branches, moved_specimen
from .traced_joint import BODIES, Place

# Number of random specimens of a class that offers none, poses of each specimen, and starts of
# Newton's iteration for the first specimen.
SPECIMENS, POSES, STARTS = 3, 32, 150

Check = Callable[[Specimen], Iterator[Finding]]

EQUATIONS: tuple[Check, ...] = (
    composition,
    freedoms,
    derivatives,
    right_sides,
    convergence,
    intended_branch,
    cost,
    round_off,
)
VARIANTS: Mapping[Check, tuple[str, ...]] = {
    axis_lengths: ("axis lengths",),
    exchange: ("exchange",),
    rigid_motion: ("rigid motion", "residual elsewhere"),
    size_and_place: ("size", "place"),
    named_coordinates: ("mixed style",),
    driver: ("driver",),
}
"""Each check of a variant, with the names of its findings."""
# Checks of the joint's own equations that every variant repeats: if one fails, the variants fail
# too and add no information.
FIRST = ("rank", "rows", "nu", "gamma")


def check_joint(
    joint_class: type[Joint],
    *,
    specimens: Sequence[Joint] | None = None,
    samples: int = POSES,
    seed: int = 0,
    engines: Sequence[Engine] = (),
) -> Report:
    """Examine a joint type.

    Args:
        specimens: joints of the type to examine; by default those the class offers, or random ones.
        samples: number of poses of each specimen.
        seed: seed of all random numbers.
        engines: engines for a small closed loop with the joint, beside the native one.

    Raises:
        SpecimenError: no specimen can be made.
    """
    given: Any = joint_class  # not known yet to be one
    if not isinstance(given, type):
        raise SpecimenError(f"check_joint: joint_class is {given!r}, expected a class of joints")
    rng = np.random.default_rng(seed)
    own = specimens is not None or hasattr(joint_class, "specimens")
    offered = (
        list(specimens) if specimens is not None else specimens_of(joint_class, rng, SPECIMENS)
    )
    if not offered:
        raise SpecimenError(f"{joint_class.__name__}: no specimens were offered. Give one or more.")
    found = [
        finding
        for k, joint in enumerate(offered)
        for finding in _examine(joint, k, samples, [seed, k])
    ]
    by_name: dict[str, list[Finding]] = {}
    for each in found:
        by_name.setdefault(each.check, []).append(each)
    findings = [worst(*group) for group in by_name.values()]
    failing = [each.check for each in findings if each.verdict is Verdict.FAIL]
    loop = loops(offered[0] if own else joint_class, engines, failing)
    return Report(joint_class.__name__, tuple(map(repr, offered)), seed, (*findings, *loop))


def _examine(joint: Joint, number: int, samples: int, seed: list[int]) -> Iterator[Finding]:
    """Yield all findings of one specimen."""
    rng = np.random.default_rng(seed)
    try:
        joint = between_test_bodies(joint)
        one = moved_specimen(joint, place(joint, rng), samples, rng)
    except Exception as error:  # any error of the joint's own code, reported with its line
        remedy = (
            "an equation is made of + - * / over any scalar, and of the functions of"
            " kincheck.core.program"
        )
        failed = fault_finding("equations", f"{_error_with_line(error)}; {remedy}")
        yield replace(failed, specimen=number)
        return
    kinds = ", ".join(dict.fromkeys(name.split(" row")[0] for name in one.traced.names))
    yield fault_finding("equations", "", f"{len(one.traced.names)} rows of {kinds}")
    found = [each for examine in EQUATIONS for each in _run_check(examine, one)]
    failing = [each.check for each in found if each.check in FIRST and each.verdict is Verdict.FAIL]
    for examine, names in VARIANTS.items():
        # an axis that is not a unit vector is often the reason of the other failures
        if failing and examine is not axis_lengths:
            found += [skip(name, f"first repair {', '.join(failing)}") for name in names]
        else:
            found += _run_check(examine, one)
    yield from (replace(each, specimen=None if each.pose is None else number) for each in found)
    if number == 0:
        yield from branches(one, STARTS)


def _run_check(examine: Check, one: Specimen) -> list[Finding]:
    """Return the findings of a check; an error of the joint's own code becomes the finding."""
    try:
        return list(examine(one))
    except Exception as error:  # any error of the joint's own code
        return [fault_finding(examine.__name__.replace("_", " "), _error_with_line(error))]


def _error_with_line(error: Exception) -> str:
    """Return the text of an error with the line that raised it."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} (in {where.name}: {where.line})"


# Usual size of a joint [m].
SIZE = 0.1
# Coordinates are whole multiples of this length [m], so a move by a thousand kilometres does not
# round them.
GRID = 2.0**-30
# Angles [degrees] of the two directions of a pair. First the cross of a universal joint, over a
# right angle by round-off, so that a joint with a positive cosine refuses it; then shafts that
# point in the same direction.
ANGLES = (90.0 + 1e-8, 40.0)


class SpecimenError(KincheckError):
    """No specimen of a joint type can be made."""


def specimens_of(joint_class: type[Joint], rng: np.random.Generator, count: int) -> list[Joint]:
    """Return instances of a joint type between bodies i and j: those of its classmethod
    `specimens`, or `count` random ones.

    Raises:
        SpecimenError: the class refuses geometry by the kinds of its fields, or a field
            has no kind.
    """
    offered: Callable[[], Sequence[Joint]] | None = getattr(joint_class, "specimens", None)
    if offered is not None:
        return list(offered())
    return [_random(joint_class, rng) for _ in range(count)]


def _random(joint_class: type[Joint], rng: np.random.Generator) -> Joint:
    remedy = f"offer some by a classmethod `specimens() -> list[{joint_class.__name__}]`"
    if not is_dataclass(joint_class) or getattr(joint_class, "__abstractmethods__", None):
        missing = ", ".join(sorted(getattr(joint_class, "__abstractmethods__", ()))) or "its fields"
        raise SpecimenError(f"{joint_class.__name__} is not complete: define {missing}")
    given = {"name": joint_class.__name__, **dict(zip("ij", BODIES, strict=True))}
    unknown = [
        each.name
        for each in required_fields(joint_class)
        if each.name not in given and "kind" not in each.metadata
    ]
    if unknown:
        raise SpecimenError(
            f"{joint_class.__name__}: field {unknown[0]!r} has no kind. Declare it by position(),"
            f" direction(), positions(), directions() or length(), or {remedy}."
        )
    makers = (partial(_value, rng=rng, angle=math.radians(angle)) for angle in ANGLES)
    try:
        return make_fitting(joint_class, given, makers)
    except MechanismError as refused:
        raise SpecimenError(
            f"{joint_class.__name__}: no specimen can be made of random geometry ({refused});"
            f" {remedy}"
        ) from refused


def _value(field: Field[Any], rng: np.random.Generator, angle: float) -> Any:
    centre = rng.uniform(-4.0 * SIZE, 4.0 * SIZE, 3)
    ends = [centre, centre + SIZE * unit_vector(rng.normal(size=3))]
    a, other = unit_vector(rng.normal(size=3)), rng.normal(size=3)
    b = math.cos(angle) * a + math.sin(angle) * unit_vector(other - (a @ other) * a)
    # directions may have any length
    stretch = rng.uniform(0.5, 2.0, 2)
    makers: Mapping[Kind, Callable[[], Any]] = {
        Kind.POSITION: lambda: _snap_to_grid(centre),
        Kind.POSITIONS: lambda: tuple(map(_snap_to_grid, ends)),
        Kind.DIRECTION: lambda: triple(stretch[0] * a),
        Kind.DIRECTIONS: lambda: (triple(stretch[0] * a), triple(stretch[1] * b)),
        Kind.LENGTH: lambda: float(rng.uniform(0.5, 1.5) * SIZE),
    }
    return makers[field.metadata["kind"]]()


def place(joint: Joint, rng: np.random.Generator) -> Place:
    """Return body origins near the joint, but at none of its points, and a unit near its size."""
    points = np.array(joint.points_on()).reshape(-1, 3)
    lengths = [value for _, kind, value in joint.parts() if kind is Kind.LENGTH]
    extent = float(np.ptp(points, axis=0).max()) if len(points) > 1 else 0.0
    size = max([extent, *(abs(x) for x in lengths if x)]) or SIZE
    centre = points.mean(axis=0) if len(points) else np.zeros(3)
    origins = (_snap_to_grid(centre + size * rng.uniform(-1.0, 1.0, 3)) for _ in BODIES)
    first, second = origins
    return Place((first, second), 2.0 ** round(math.log2(size)))


def between_test_bodies(joint: Joint) -> Joint:
    """Return the joint between the bodies i and j instead of its own, with its
    points on the grid.
    """
    return replace(joint, i=BODIES[0], j=BODIES[1], **joint.mapped({Kind.POSITION: _snap_to_grid}))


def unit_vector(a: Array) -> Array:
    """Return the direction of a vector in doubles."""
    return np.asarray(a / np.linalg.norm(a))


def _snap_to_grid(point: Any) -> tuple[float, ...]:
    return triple(np.round(np.asarray(point) / GRID) * GRID)
