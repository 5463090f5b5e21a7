"""Check a joint type: everything that can be found out about a Joint class without knowing what it
is.

    from kincheck.core import check_joint

    def test_my_joint():
        report = check_joint(MyJoint)
        assert report.passed, report

Each check is a row of the report: the worst number found, the limit and its reason, where it was
found. What cannot be checked is a row too. A class may offer two things of its own:

    @classmethod
    def specimens(cls) -> list[Self]          joints to examine, where random geometry of the fields' kinds does not do
    def equivalent(self) -> tuple[list[Body], list[Joint]]
                                              further bodies and known joints that do between self.i
                                              and self.j what this joint does: with them simulators
                                              that do not know the joint can be compared with it
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from ...harness.engine import Engine
from ...joints import Joint
from . import specimens as joint_specimens
from .branches import branches
from .checks import (
    Specimen,
    composition,
    convergence,
    cost,
    derivatives,
    freedoms,
    intended_branch,
    right_sides,
    round_off,
    specimen,
)
from .findings import Finding, Report, Verdict
from .loop import loops
from .variants import axis_lengths, exchange, named_coordinates, rigid_motion, size_and_place

# Random specimens of a class that offers none, poses of each, and starts of Newton's iteration of
# the first.
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
}
"""With the names of their findings."""
# What a variant is judged by: where the joint's own equations fail there, it fails too and says
# nothing new.
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
        specimens: joints of the type to examine; otherwise those the class offers, or random ones.
        samples: poses of each specimen.
        seed: of all random numbers.
        engines: to solve a small closed loop with the joint, beside the native one.

    Raises:
        SpecimenError: no specimen can be made.
    """
    rng = np.random.default_rng(seed)
    own = specimens is not None or hasattr(joint_class, "specimens")
    offered = (
        list(specimens)
        if specimens is not None
        else joint_specimens.specimens(joint_class, rng, SPECIMENS)
    )
    if not offered:
        raise joint_specimens.SpecimenError(
            f"{joint_class.__name__}: no specimens were offered; give one or more"
        )
    found = [
        finding
        for k, joint in enumerate(offered)
        for finding in _examined(joint, k, samples, [seed, k])
    ]
    order = {name: k for k, name in enumerate(dict.fromkeys(each.check for each in found))}
    by_name = groupby(
        sorted(found, key=lambda each: order[each.check]), key=lambda each: each.check
    )
    worst = [max(group, key=lambda each: each.badness) for _, group in by_name]
    loop = loops(offered[0] if own else joint_class, engines)
    return Report(joint_class.__name__, tuple(map(repr, offered)), seed, (*worst, *loop))


def _examined(joint: Joint, number: int, samples: int, seed: list[int]) -> Iterator[Finding]:
    """All findings of one specimen."""
    rng = np.random.default_rng(seed)
    try:
        joint = joint_specimens.between(joint)
        one = specimen(joint, joint_specimens.place(joint, rng), samples, rng)
    except Exception as error:  # whatever the joint's own code raises; said in full, with its place
        remedy = (
            "an equation is made of + - * / over any scalar, and of the functions of"
            " kincheck.core.program"
        )
        yield Finding(
            "equations", Verdict.FAIL, specimen=number, message=f"{_told(error)}; {remedy}"
        )
        return
    kinds = ", ".join(dict.fromkeys(name.split(" row")[0] for name in one.traced.names))
    yield Finding("equations", Verdict.PASS, message=f"{len(one.traced.names)} rows of {kinds}")
    found = [each for examine in EQUATIONS for each in _made(examine, one)]
    failing = [each.check for each in found if each.check in FIRST and each.verdict is Verdict.FAIL]
    for examine, names in VARIANTS.items():
        # an axis that is not unit is often why the others fail
        if failing and examine is not axis_lengths:
            found += [
                Finding(name, Verdict.SKIP, message=f"first repair {', '.join(failing)}")
                for name in names
            ]
        else:
            found += _made(examine, one)
    yield from (replace(each, specimen=None if each.pose is None else number) for each in found)
    if number == 0:
        yield from branches(one, STARTS)


def _made(examine: Check, one: Specimen) -> list[Finding]:
    """The findings of a check; where the joint's own code raises, that is the finding."""
    try:
        return list(examine(one))
    except Exception as error:  # whatever the joint's own code raises
        return [Finding(examine.__name__.replace("_", " "), Verdict.FAIL, message=_told(error))]


def _told(error: Exception) -> str:
    """An error with the line that raised it."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} (in {where.name}: {where.line})"
