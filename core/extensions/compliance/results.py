"""Results of a compliance study: curves over travel and over loads, and the numbers that chassis
engineers quote of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...case.case import Case
from ...errors import number_of, shortened
from ...harness.record import Results
from ...trajectory import Array
from .rates import SIDES, Curve
from .rig import PER
from .section import Load

WHEEL_LOAD = "wheel_load"
"""Name of the first curve, which a driver's effort in a case may have as well."""
COMPLIANCE = "compliance"
NOT_COMPUTED = "not computed: "
"""Before the outputs without a curve, in notes."""
MOST_LOST = 6
"""Names that such a note has."""
QUOTED: Mapping[str, str] = {
    WHEEL_LOAD: "wheel load",
    "wheel_rate": "wheel rate",
    "ride_rate": "ride rate at the wheel, with the tire",
    "roll_stiffness": "roll stiffness",
    "spring_ratio": "motion ratio of the spring",
    "toe.per_travel": "bump steer",
    "camber.per_travel": "bump camber",
    "caster.per_travel": "caster change",
    "half_track_change.per_travel": "half track change",
    "roll_center_height": "roll centre height",
    "toe.per_lateral_force": "toe by lateral force",
    "camber.per_lateral_force": "camber by lateral force",
    "toe.per_aligning_torque": "toe by aligning torque",
    "toe.per_braking_force": "toe by braking force",
    f"lateral_{COMPLIANCE}": "lateral compliance at the contact",
    f"longitudinal_{COMPLIANCE}": "longitudinal compliance at the contact",
}
"""Names in the summary, by quantity; of an axle, those of the left wheel."""
BY_LOADS = (*PER.values(),)
RIDE_RATE = "ride_rate"
WITHOUT_TIRE = 'it needs the rate of the tire. Add --spring "tire: 200 N/mm" with yours'
RIGID = "nothing gives way to a load, as all joints are rigid. Give --bushings FILE"
LOAD = "upward force to hold the height of the wheel's centre"


@dataclass(frozen=True)
class Quoted:
    """A number of the summary, at the sample nearest to design.

    Attributes:
        name: of the output.
        label: in words.
        value: [SI]; None if it is not computed.
        says: the meaning of its sign, or why there is none.
    """

    name: str
    label: str
    value: float | None
    unit: str
    says: str


@dataclass(frozen=True, eq=False)
class ComplianceCurves:
    """Results over travel, or over a load at design.

    Attributes:
        axis: name of the varied quantity: "travel", or a load.
        at: its values [m, N or N m], shape (n,).
        wheel_center, spin_axis: of the (left) wheel, global [m, -], shape (n, 3).
        wheel_load: upward force to hold its centre's height [N], shape (n,); NaN if nothing loads
            the wheel.
        compliance: C, shape (n, 6, 6) or (n, 12, 12).
        outputs: outputs and their slopes by name.
        rigid: outputs of the mechanism with joints in place of bushings, over travel.
        not_computed: reasons by quantity that has no curve.
        reached: whether there is an equilibrium, shape (n,).
        failures: samples without equilibrium, and the last ones with it.
        notes: facts for readers.
        turning: whether the travel is an angle.
        upward: whether the travel is that of the wheel.
        rigid_joints: whether nothing gives way to a load, so that compliances are zero.
    """

    axis: str
    at: Array
    wheel_center: Array
    spin_axis: Array
    wheel_load: Array
    compliance: Array
    outputs: Mapping[str, Curve]
    rigid: Mapping[str, Array]
    not_computed: Mapping[str, str]
    reached: NDArray[np.bool_]
    failures: tuple[str, ...]
    notes: tuple[str, ...]
    turning: bool = False
    upward: bool = False
    rigid_joints: bool = False

    @property
    def near_design(self) -> int:
        """The sample nearest to design, of those with an equilibrium if there are any."""
        return int(np.argmin(np.where(self.reached, np.abs(self.at), np.inf)))

    def summary(self) -> Iterator[Quoted]:
        """Yield the numbers that chassis engineers quote."""
        curves, k = (
            {WHEEL_LOAD: Curve(self.wheel_load, "N", LOAD), **self.outputs},
            self.near_design,
        )
        for name, label in QUOTED.items():
            own = next((x for x in (name, f"{SIDES[0]}_{name}") if x in curves), name)
            reason = self.not_computed.get(own, "")
            if own == RIDE_RATE and "wheel_rate" in curves:
                reason = WITHOUT_TIRE
            curve = None if own in self.not_computed else curves.get(own)
            if curve is not None:
                side = f", {SIDES[0]}" if own != name else ""
                value = float(curve.values[k])
                known = value if np.isfinite(value) else None
                still = self.rigid_joints and (COMPLIANCE in own or own.endswith(BY_LOADS))
                yield Quoted(own, label + side, known, curve.unit, RIGID if still else curve.sense)
            elif reason:
                yield Quoted(own, label, None, "", reason)

    @property
    def lost(self) -> list[str]:
        """A line for each reason of outputs without a curve."""
        names: dict[str, list[str]] = {}
        for name, reason in self.not_computed.items():
            names.setdefault(reason, []).append(name)
        return [f"{NOT_COMPUTED}{shortened(each, MOST_LOST)}: {why}" for why, each in names.items()]


@dataclass(frozen=True, eq=False, repr=False)
class ComplianceResults:
    """Results of a study: over travel, and over each load at design by its name.

    Attributes:
        cases: the same equilibria for engines, in the same order.
        checked: records of engines.
    """

    case: str
    travel: ComplianceCurves
    loads: Mapping[Load, ComplianceCurves] = field(default_factory=dict[Load, ComplianceCurves])
    signs: str = ""
    cases: tuple[Case, ...] = ()
    checked: Results | None = None

    def __repr__(self) -> str:
        found = number_of(len(self.travel.at), "sample")
        lost = f", {len(self.failures)} without equilibrium" if self.failures else ""
        return f"<ComplianceResults: {self.case}, {found} of travel{lost}>"

    @property
    def failures(self) -> list[str]:
        """All samples without equilibrium."""
        every = (self.travel, *self.loads.values())
        return [message for each in every for message in each.failures]
