"""The verdict on two files: the same motion, another one, or too little to say.

The motion of either file must satisfy the rows of the other one, and both must have as many
freedoms. Limits, masses and other facts beside motion are compared in `lost`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ...errors import shortened
from ...trajectory import Array
from ..free.free_poses import FreePoses, Poses, Walked
from ..residuals.replay import Residuals
from .links import Match, match_links
from .lost import lost_items
from .motion import Placement, left_in, measurable, placement, tied_links, values
from .undriven import Undriven

WALKS, STEPS, SEEDS = 5, 6, (1, 2)
"""Walks of a file, steps of each, and seeds of either direction."""
# Of all poses, at least this part must be reached.
ENOUGH = 0.5
# Residuals of this part of the size are rounding: two files with all digits agree to 1e-14.
ROUNDING = 1e-9
MOST_NAMED = 4
UNITS = {
    1000.0: "metres and millimetres",
    100.0: "metres and centimetres",
    39.3701: "metres and inches",
    25.4: "millimetres and inches",
    3.28084: "metres and feet",
}
"""Ratios of lengths in two units."""
SAME_UNIT = 1e-4
# Digits that allow less are all of them [m].
EXACT = 1e-12


@dataclass(frozen=True, eq=False)
class Comparison:
    """The findings of a comparison of two files.

    Attributes:
        files: their names.
        verdict: "same", "differs" or "not judged".
        reason: how it differs, or why it is not judged.
        largest: largest residual of any row at any pose [m]; None if there is none.
        allowed: the part that the digits of the files may cause [m].
        freedoms: of each file.
        lost: facts beside motion that one file lacks or has otherwise.
        poses: number of compared poses.
        placement: place of the first file in the second one; None if it is not known.
        remarks: of the readers of the files.
    """

    files: tuple[str, str]
    verdict: str
    reason: str
    largest: float | None
    allowed: float
    freedoms: tuple[int, int]
    lost: Sequence[str]
    poses: int
    match: Match
    placement: Placement | None
    remarks: Sequence[str] = ()

    @property
    def text(self) -> str:
        """The verdict in one line."""
        if self.verdict != "same" or self.largest is None:
            return f"{self.verdict}: {self.reason}"
        by_digits = min(self.largest, self.allowed)
        all_of = "all" if by_digits == self.largest else f"{by_digits:.1e} m"
        digits = f" ({all_of} of it by the files' digits)" if self.allowed > EXACT else ""
        lost = f"; {'; '.join(self.lost)}" if self.lost else ""
        return f"the same motion within {self.largest:.1e} m{digits}{lost}"

    @property
    def notes(self) -> Sequence[str]:
        """Remarks, and how links and places of both files were brought together."""
        pairs = [f"{x} = {y}" for x, y in self.match.partner.items() if x != y]
        found = [*self.remarks]
        found += [f"links are matched {self.match.how}: {', '.join(pairs)}"] * bool(pairs)
        if self.placement is not None:
            far, angle = float(np.linalg.norm(self.placement.shift)), self.placement.angle
            if far > ROUNDING or angle > ROUNDING:
                shift = ", ".join(f"{x:.6g}" for x in self.placement.shift)
                first, second = self.files
                found.append(
                    f"{first} stands in {second} turned by {angle:.6g} rad and moved by ({shift}) m"
                )
        one = [
            f"{', '.join(names)} of {file}"
            for file, names in zip(self.files, self.match.alone, strict=True)
            if names
        ]
        if one:
            found.append(f"links of one file alone, placed where they fit: {'; '.join(one)}")
        return found

    def report(self) -> dict[str, Any]:
        """Return all of it as JSON."""
        return {
            "files": [*self.files],
            "verdict": self.verdict,
            "reason": self.reason,
            "largest_m": self.largest,
            "allowed_by_digits_m": self.allowed,
            "freedoms": [*self.freedoms],
            "lost": [*self.lost],
            "poses": self.poses,
            "matched": dict(self.match.partner),
            "notes": [*self.notes],
        }


def compare(a: Undriven, b: Undriven, given: Mapping[str, str]) -> Comparison:
    """Compare two mechanisms.

    Args:
        given: partners of links of the first one, named by the user.

    Raises:
        KincheckError: a named partner is no link.
    """
    return _Pair(a, b, match_links(a, b, given)).compared()


class _Pair:
    """Two files during their comparison."""

    def __init__(self, a: Undriven, b: Undriven, match: Match) -> None:
        self.files, self.match = (a, b), match
        self.motions = FreePoses(a.mechanism), FreePoses(b.mechanism)
        self.sizes = [each.size for each in self.motions]
        # an angle is off by twice a component of a quaternion
        self.allowed = max(self.sizes) * sum(
            2.0 * x.error * (x.chain + 1) + x.angle_error for x in self.files
        )
        self.enough = ROUNDING * max(self.sizes) + self.allowed

    def compared(self) -> Comparison:
        """Return the comparison."""
        (a, b), match = self.files, self.match
        walked = [
            free.walk(WALKS, STEPS, seed, partial(outside, file))
            for file, free, seed in zip(self.files, self.motions, SEEDS, strict=True)
        ]
        found = Comparison(
            files=(a.name, b.name),
            verdict="not judged",
            reason=self._reason_unjudged(walked),
            largest=None,
            allowed=self.allowed,
            freedoms=(walked[0].freedom, walked[1].freedom),
            lost=(),
            poses=sum(each.reached for each in walked),
            match=match,
            placement=None,
            remarks=(*a.notes, *b.notes),
        )
        if found.reason:
            differ = [*self._freedoms(walked)]
            kind = "differs" if differ else "not judged"
            return replace(found, verdict=kind, reason="; ".join([*differ, found.reason]))
        own = walked[0].poses
        place = placement(a, b, match, own, self.motions[1], self.enough)
        back, reverse = place.reversed, match.reversed
        there = place.all(own, a, b, match), back.all(walked[1].poses, b, a, reverse)
        left = left_in(b, self.motions[1], there[0]), left_in(a, self.motions[0], there[1])
        reasons = [*self._scale(), *self._freedoms(walked), *self._off(left, walked)]
        same = not reasons
        largest = _largest(left)
        if same and place.by_frames and largest > ROUNDING * max(self.sizes):
            # frames are equal within digits, and the motion since the start may be so closer
            moved = replace(place, by_frames=False)
            again = left_in(b, self.motions[1], moved.all(own, a, b, match))
            largest = min(largest, _largest([again]))
        return replace(
            found,
            verdict="same" if same else "differs",
            reason="; ".join(reasons),
            largest=largest,
            lost=lost_items(a, b, match, place, (own, there[0]), self.enough) if same else [],
            placement=place,
        )

    def _reason_unjudged(self, walked: Sequence[Walked]) -> str:
        """Return why nothing can be judged; empty if something can."""
        alone = [
            [link for link in links if not file.is_between(link)]
            for file, links in zip(self.files, self.match.alone, strict=True)
        ]
        if all(alone) or not self.match.partner:
            names = [
                f"{shortened(links or [*each], MOST_NAMED)} of {file.name}"
                for file, links, each in zip(self.files, alone, self.match.alone, strict=True)
            ]
            return (
                f"links without a partner: {' and '.join(names)}; name partners by --match"
                " LINK=LINK"
            )
        if not any(each.freedom for each in walked):
            return "nothing moves in either file"
        for file, each in zip(self.files, walked, strict=True):
            if each.freedom and each.reached < ENOUGH * each.wanted:
                return (
                    f"too few poses: {each.reached} of {each.wanted} of {file.name} are reached,"
                    f" expected {ENOUGH:.0%}; correct its limits, or its start"
                )
        return ""

    def _scale(self) -> Iterator[str]:
        """Yield how lengths differ as a whole."""
        ratio = self.sizes[1] / self.sizes[0]
        for factor, units in UNITS.items():
            for x, y in ((ratio, factor), (1.0 / ratio, factor)):
                if abs(x / y - 1.0) < SAME_UNIT:
                    yield (
                        f"lengths of {self.files[1].name} are {ratio:.6g} times those of"
                        f" {self.files[0].name}, as between {units}"
                    )

    def _freedoms(self, walked: Sequence[Walked]) -> Iterator[str]:
        """Yield different freedoms, with the joints of one file alone."""
        first, second = (each.freedom for each in walked)
        if first != second:
            tied = (
                tied_links(self.files[0], self.match.partner),
                tied_links(self.files[1], {y: y for y in self.match.partner.values()}),
            )
            fewer = int(second < first)
            names = [name for links, name in tied[fewer].items() if links not in tied[1 - fewer]]
            only = f": {shortened(names, MOST_NAMED)} in {self.files[fewer].name} only"
            yield f"freedom {first} against {second}{only if names else ''}"

    def _off(self, left: Sequence[Residuals], walked: Sequence[Walked]) -> Iterator[str]:
        """Yield the joints left by the motion of the other file."""
        for k, found in enumerate(left):
            worst = found.worst("position")
            if worst is None or worst.value <= self.enough:
                continue
            mover, judge = self.files[k], self.files[1 - k]
            most: dict[str, float] = {}
            for name, x in zip(found.joints, np.abs(found.position).max(axis=0), strict=True):
                most[name] = max(most.get(name, 0.0), float(x))
            others = sorted(
                (name for name, x in most.items() if x > self.enough and name != worst.joint),
                key=lambda name: -most[name],
            )
            more = f" (and {shortened(others, MOST_NAMED)})" if others else ""
            yield (
                f"{worst.joint} of {judge.name}{more} by {worst.value:.2g} m in the motion of"
                f" {mover.name}, {_where(mover, walked[k].poses, worst.sample)}"
            )


def _largest(left: Sequence[Residuals]) -> float:
    return max(float(np.abs(each.position).max(initial=0.0)) for each in left)


def outside(file: Undriven, poses: Poses) -> Array:
    """Return how far poses are outside of the limits of a file [rad, m], shape (n,)."""
    far = np.zeros(len(next(iter(poses.values()))))
    for name, each in file.coordinates.items():
        if each.limit.lower < each.limit.upper and measurable(file, name):
            x = values(file, name, each, poses)
            far = np.maximum(far, np.maximum(each.limit.lower - x, x - each.limit.upper))
    return far


def _where(file: Undriven, poses: Poses, sample: int) -> str:
    """Return the coordinates of a pose in words."""
    at = {name: each[sample : sample + 1] for name, each in poses.items()}
    texts = [
        f"{name} = {values(file, name, each, at)[0]:.3g} {'rad' if each.turns else 'm'}"
        for name, each in file.coordinates.items()
        if measurable(file, name)
    ]
    return f"at {shortened(texts, MOST_NAMED)}" if texts else f"at pose {sample}"
