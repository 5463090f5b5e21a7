"""Diagnosis of a case: freedom and rank by name, conditioning along the
sweep, output sensitivities.
"""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np

from ...case.case import ORDERS, Case
from ...case.notes import notes
from ...errors import SolveError, number_of, shortened
from ...forces import Reaction
from ...harness.native_engine import explain
from ...kinematics import forces_of
from ...trajectory import Array, Trajectory
from ..sweep.varied_places import Geometry
from .bump_steer import bump_steer
from .conditioning import Conditioning, conditioning
from .outputs import Budget, Sensitivity, binding_numbers, budgets, read_points, sensitivities
from .rank import (
    Blocked,
    ComponentCount,
    Dependency,
    NamedRow,
    Ranks,
    Screw,
    Violation,
    describe_screws,
    joints_that_free,
)

# Samples to look at: the count of determined directions changes at special poses only.
SAMPLES = 9


class JointDeterminacy(msgspec.Struct, frozen=True):
    """What rigid bodies determine of a joint's reaction on its second body.

    Attributes:
        force, moment, wrench: determined directions of 3, 3 and 6, the fewest over the samples.
        force_along, moment_along: those of force and moment at the first sample, orthonormal global
            axes.
    """

    joint: str
    force: int
    moment: int
    wrench: int
    force_along: list[list[float]]
    moment_along: list[list[float]]


class Determinacy(msgspec.Struct, frozen=True):
    """What redundant rows leave undetermined, with masses or without.

    Attributes:
        joints: how many were looked at: those of the outputs, or all.
        partly: joints not wholly determined.
        efforts: drivers whose efforts are undetermined.
    """

    joints: int
    partly: list[JointDeterminacy]
    efforts: list[str]

    def __str__(self) -> str:
        if not self.partly and not self.efforts:
            return "all reactions and efforts are determined"
        efforts = f"not those of {', '.join(self.efforts)}" if self.efforts else "all"
        return (
            f"redundant rows leave {len(self.partly)} of {self.joints} reactions not wholly"
            f" determined; of the efforts {efforts} are determined"
        )


def determinacy(case: Case, motion: Trajectory) -> Determinacy:
    """Return the determinacy of the forces that outputs read, or of all without such outputs.

    Args:
        motion: poses of all moving bodies along the sweep.
    """
    mechanism, path = case.mechanism, case.sweep.path
    solved = np.flatnonzero(motion.solved)
    few = solved[np.unique(np.linspace(0, len(solved) - 1, SAMPLES).round().astype(int))]
    # what is determined depends on the pose alone: any rates serve
    still = {
        name: replace(
            each, r=each.r[few], p=each.p[few], v=np.zeros((len(few), 6)), a=np.zeros((len(few), 6))
        )
        for name, each in motion.bodies.items()
    }
    known = np.ones(len(few), np.bool_)
    poses = Trajectory({}, known, motion.iterations[few], 0.0, bodies=still)
    names = {joint.name for joint in mechanism.given_joints}
    asked = [name for name in case.forces if name in names]
    found = forces_of(mechanism, replace(path, times=path.times[few]), poses)
    joints = {name: found.joints[name] for name in asked or found.joints}
    every = [_joint(name, each) for name, each in joints.items()]
    return Determinacy(
        len(every),
        [each for each in every if each.wrench < 6],
        [name for name, effort in found.drivers.items() if not np.isfinite(effort).any()],
    )


def _joint(name: str, found: Reaction) -> JointDeterminacy:
    force, moment, wrench = found.determined()
    known = float(np.ravel(found.known)[0])
    along = [_undetermined_directions(part, known) for part in np.split(found.free[0], 2)]
    return JointDeterminacy(name, force, moment, wrench, *along)


def _undetermined_directions(free: Array, known: float) -> list[list[float]]:
    """Return the directions across all that are undetermined, shape (3, redundant rows)."""
    if not np.isfinite(free).all():
        return []
    axes, sizes, _ = np.linalg.svd(np.hstack([free, np.zeros((3, 3))]))
    return np.where(np.abs(axes) <= known, 0.0, axes)[:, sizes <= known].T.tolist()


SCHEMA = "kincheck-explain/1"
# Joints that a sentence names as alternatives.
NAMED = 5


class Freedom(msgspec.Struct, frozen=True):
    """The count of the degrees of freedom. paper: by the paper's count (Table 5)."""

    dof: int
    drivers: list[str]
    coordinates: int
    rows: int
    rank: int
    paper: str


class Nearly(msgspec.Struct, frozen=True):
    """Rows with a nearly vanishing combination; size: its singular value of the joint rows."""

    size: float
    rows: list[NamedRow]


class Sample(msgspec.Struct, frozen=True):
    """Conditioning of a pose of the sweep; see `PoseConditioning`. condition: null if singular."""

    value: float
    smallest: float
    largest: float
    condition: float | None
    orientation: float
    direction: list[Screw]


class Diagnosis(msgspec.Struct, frozen=True):
    """The diagnosis of a case.

    Attributes:
        findings: why the case cannot be solved as described; empty if it can.
        verdict: whether it can be solved, in one sentence.
        notes: remarks on the joints' geometry.
        freeing: joints of which any one, taken out alone, frees the blocked drivers.
        binding: numbers of the geometry not to be changed alone: redundant rows contradict then.
        shims: derivatives of toe, camber and caster at design by x, y and z of each joint of a
            table that is moved while the links keep their lengths and the wheel its height [rad/m],
            by row.
        bump_steer: slope of toe by travel at design [rad/m]; null without.
        no_bump_steer: how far each end of a tie rod moves along x, y or z of the table alone to
            leave no bump steer at design [m], by row; null where it has no effect.
        bump_steer_left: the bump steer of the table with this move, solved again [rad/m]; null for
            a move beyond 50 mm, which is out of reach, or if it cannot be solved.
        moves: places of the case that follow each hardpoint, direction or length, by its name.
        signs: sign conventions of the outputs; empty without.
        not_derived: outputs of more than the pose, without budget.
        programs: lines on the native engine's programs and the parts left out.
        determinacy: of reactions and efforts, if forces are asked for; null if it cannot be solved.
    """

    schema: str
    case: str
    verdict: str
    findings: list[str]
    notes: list[str]
    freedom: Freedom
    components: list[ComponentCount]
    redundant: list[Dependency]
    nearly_redundant: list[Nearly]
    free: list[list[Screw]]
    blocked: list[Blocked]
    freeing: list[str]
    contradictions: list[Violation]
    swept: str
    reached: int
    samples: list[Sample]
    redundant_residual: float | None
    budgets: list[Budget]
    sensitivities: list[Sensitivity]
    binding: list[str]
    shims: dict[str, list[list[float]]]
    bump_steer: float | None
    no_bump_steer: dict[str, list[float | None]]
    bump_steer_left: dict[str, list[float | None]]
    moves: dict[str, list[str]]
    signs: str
    not_derived: list[str]
    programs: list[str]
    determinacy: Determinacy | None

    @property
    def worst(self) -> Sample | None:
        """The sample with the smallest singular value."""
        return min(self.samples, key=lambda each: each.smallest, default=None)


def diagnose(case: Case, *, samples: int, tol: float) -> Diagnosis:
    """Diagnose a case, as far as possible if it cannot be solved.

    Args:
        samples: number of samples of the sweep to examine.
        tol: residuals left by engines, relative to the mechanism's size.

    Raises:
        SolveError: no body can move.
    """
    mechanism = case.mechanism
    if not mechanism.moving:
        raise SolveError(
            f"mechanism {mechanism.name!r}: no body can move. Declare a body that is not fixed."
        )
    ranks = Ranks(mechanism)
    account = ranks.account
    findings = _findings(ranks)
    geometry = Geometry(case)
    variables = geometry.variables
    swept: Conditioning | None = None
    programs: list[str] = []
    if not findings:
        try:
            programs = explain(case)
            swept = conditioning(
                mechanism,
                case.sweep.path,
                case.sweep.values,
                read_points(case),
                geometry.moves(variables),
                samples,
                tol,
            )
            findings += [swept.trajectory.message] * bool(swept.trajectory.message)
        except SolveError as error:
            findings.append(str(error))
    freedom = Freedom(
        account.dof,
        [driver.name for driver in mechanism.drivers],
        account.moving_coordinates,
        account.rows,
        account.rank,
        account.paper_count,
    )
    derived = swept is not None and bool(swept.poses)
    forces = (
        determinacy(case, swept.trajectory) if swept and swept.trajectory.solved.any() else None
    )
    steer, left = bump_steer(case) if derived else (None, {})
    return Diagnosis(
        schema=SCHEMA,
        case=case.name,
        verdict=_verdict(ranks, findings, swept, forces),
        findings=findings,
        notes=notes(case),
        freedom=freedom,
        components=ranks.components,
        redundant=ranks.dependencies,
        nearly_redundant=[Nearly(size, rows) for size, rows in ranks.nearly],
        free=ranks.free,
        blocked=ranks.blocked,
        freeing=joints_that_free(ranks)[0] if ranks.blocked else [],
        contradictions=ranks.contradictions,
        swept=case.sweep.driver,
        reached=int(swept.trajectory.solved.sum()) if swept else 0,
        samples=_samples(swept) if swept else [],
        redundant_residual=swept.trajectory.details["redundant_residual"] if swept else None,
        budgets=budgets(case, swept, tol) if swept and derived else [],
        sensitivities=sensitivities(case, swept, geometry) if swept and derived else [],
        binding=binding_numbers(swept, variables) if swept and derived else [],
        shims={each.name: each.shim.tolist() for each in case.hardpoints if each.shim is not None},
        bump_steer=steer,
        no_bump_steer={
            each.name: [float(x) if np.isfinite(x) else None for x in each.no_bump_steer]
            for each in case.hardpoints
            if each.no_bump_steer is not None
        },
        bump_steer_left=left,
        moves={each.name: each.places for each in variables},
        signs=case.signs,
        not_derived=[output.name for output in case.outputs if output.orders != ORDERS],
        programs=programs,
        determinacy=forces,
    )


def _samples(swept: Conditioning) -> list[Sample]:
    return [
        Sample(
            p.value,
            p.smallest,
            p.largest,
            p.condition if p.smallest else None,
            p.orientation,
            p.direction,
        )
        for p in swept.poses
    ]


def _verdict(
    ranks: Ranks, findings: list[str], swept: Conditioning | None, forces: Determinacy | None
) -> str:
    """Return in one plain sentence whether the case can be solved, and if not, the kind of the
    reason.
    """
    dof, drivers = ranks.account.dof, len(ranks.mechanism.drivers)
    count = f"{number_of(dof, 'degree', 'degrees')} of freedom, {number_of(drivers, 'driver')}"
    if ranks.contradictions:
        return f"the joints contradict each other: it does not close at the design ({count})"
    if ranks.blocked:
        names, free = joints_that_free(ranks)
        remedy = f"; it moves without {_alternatives(names)}" if names else ""
        more = f", which leaves {number_of(free, 'motion')} free" if names and free else ""
        return f"over-constrained, a driver cannot move: {count}{remedy}{more}"
    if ranks.free:
        kind = "under-constrained" if dof > drivers else "singular at the design"
        return f"{kind}, the drivers do not determine the motion: {count}"
    if swept is None or findings:
        reached = int(swept.trajectory.solved.sum()) if swept else 0
        samples = len(swept.trajectory.solved) if swept else 0
        return f"the sweep cannot be followed: {reached} of {samples} samples reached ({count})"
    worst = max((p.condition for p in swept.poses), default=1.0)
    lost = f"{np.log10(worst):.0f} of 16 digits at most are lost to conditioning"
    redundant = number_of(len(ranks.dependencies), "redundant row")
    told = f"; {forces}" if ranks.dependencies and forces is not None else ""
    return f"it can be solved: {count}, {redundant}; all samples reached; {lost}{told}"


def _alternatives(names: list[str]) -> str:
    """Return the first names as alternatives, "a", "a or b"."""
    texts = [repr(name) for name in names[:NAMED]]
    return " or ".join(filter(None, (", ".join(texts[:-1]), texts[-1])))


def _findings(ranks: Ranks) -> list[str]:
    """Return why the mechanism cannot be solved as described."""
    found: list[str] = []
    count, drivers = ranks.account.dof, len(ranks.mechanism.drivers)
    if ranks.contradictions:
        found.append(
            "it does not close at the design: in the nearest pose these rows are off:"
            f" {_violations(ranks.contradictions)}; check the points, axes and lengths of these"
            " joints"
        )
    for each in ranks.blocked:
        found.append(
            f"driver {each.driver!r} cannot move what it drives: for each unit of it other rows"
            f" would have to give way, at the least {_violations(each.rows)}; {_remedy(ranks)}"
        )
    if ranks.free and count > drivers:
        motions = "; ".join(describe_screws(motion) for motion in ranks.free)
        found.append(
            f"{len(ranks.free)} motion{'s are' if len(ranks.free) > 1 else ' is'} left free with"
            f" the drivers held: {motions}; add a driver for each, or join what spins freely (a rod"
            " between two balls: use distance)"
        )
    elif ranks.free:
        found.append(
            "at the design the drivers do not determine the motion (lock-up or dead centre), it"
            f" can still move: {'; '.join(describe_screws(motion) for motion in ranks.free)}; drive"
            " another coordinate or shift the design"
        )
    return found


def _remedy(ranks: Ranks) -> str:
    if ranks.nearly:
        size, rows = ranks.nearly[0]
        owners = ", ".join(dict.fromkeys(row.owner for row in rows))
        return (
            f"a combination of rows of {owners} nearly vanishes ({size:.1e}): make their geometry"
            " exactly parallel or aligned"
        )
    names, free = joints_that_free(ranks)
    if not names:
        return "remove a driver or free the mechanism"
    more = f", which leaves {number_of(free, 'motion')} free" if free else ""
    return f"remove the driver, or take out {_alternatives(names)}{more}"


def _violations(rows: tuple[Violation, ...] | list[Violation], most: int = 4) -> str:
    return shortened(
        [
            f"{each.row} by {abs(each.amount):.2g} {'m' if 'along' in each.row.holds else 'rad'}"
            for each in rows
        ],
        most,
    )
