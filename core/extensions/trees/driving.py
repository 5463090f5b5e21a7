"""Start and drive of a model, by the options --start, --drive, --hold and --hold-rest: its file
says neither.

Degrees of freedom are counted by the motions left by the ties to the moves' coordinates, so the
count is the same whatever is held or driven.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...algebra import quat, vec
from ...case.io.document import decimal, interval, measure, shown, unknown_name, usable
from ...case.io.schema import MOST_SAMPLES
from ...case.units import ANGLES, LENGTHS
from ...errors import MOST_NAMED, CaseError, remedy, shortened, with_article
from ...trajectory import Array
from ..xml.element import Element
from .assembly import AT_REST, Assembled, Pose, Start, Value
from .options import ModelOptions
from .place import Place, unit_quaternion
from .tree import UNKNOWNS, Move, Tree

COORDINATES = {"hinge": 1, "slide": 1, "ball": 4, "free": 7}
KEYFRAME = "keyframe:"
SAMPLES = 41
# A range of more turns without a unit is more likely in degrees than in radians.
MANY_TURNS = 2.0
# A move that has less of them may have it by the file's digits alone, which lead the mechanism
# anywhere when it is held. It is held if no other one can be.
CLEARLY = 0.01
# Joints without a motor that --hold-rest holds unasked: the largest public model without motors, an
# arm with a hand (MyoSuite), has 27. More are most often the loops that a file has lost.
MOST_HELD = 30
MOST_MOTORS = 8


def read_start(tree: Tree, said: Sequence[str]) -> Start:
    """Return the start of a model: its zero pose, or what --start says.

    Raises:
        CaseError: there is no such keyframe or move, one is given twice, or its numbers are not
            those of the move.
    """
    values = dict(Pose.of(tree).value_of)
    given: list[str] = []
    text = ", ".join(said) if said else tree.zero
    said = [own for each in said for own in tree.starts.get(each.removeprefix(KEYFRAME), [each])]
    keyframes = [each for each in said if each.startswith(KEYFRAME)]
    if len(keyframes) > 1:
        raise tree.fault("--start", f"found {len(keyframes)} keyframes, expected one; name one")
    if keyframes:
        values |= _keyframe(tree, keyframes[0].removeprefix(KEYFRAME))
    for each in said:
        if each in keyframes:
            continue
        name, sign, value = each.rpartition("=")
        if not sign:
            form = f"{KEYFRAME}NAME or JOINT=VALUE [rad or m, as qpos]"
            raise tree.fault("--start", f"found {shown(each)}, expected {form}; say the value")
        if name not in tree.moves:
            raise unknown_name(tree.file, "--start", name, tree.moves, "a joint")
        if name in given:
            raise tree.fault("--start", f"found {shown(name)} twice; give one value")
        values[name] = _value(tree, tree.moves[name], value.split(","))
        given.append(name)
    return Start(Pose(tree, [*values.values()]), tuple(given), text, tree.closes and not given)


def _keyframe(tree: Tree, name: str) -> dict[str, Value]:
    if name not in tree.keyframes:
        raise tree.fault(
            "--start",
            f"found {shown(KEYFRAME + name)}, expected a keyframe of the model, by name or by"
            f" number from 0; {remedy(name, [*tree.keyframes, *tree.starts])}",
        )
    element, numbers = tree.keyframes[name]
    if numbers is None:
        return {}
    count = sum(COORDINATES[move.kind] for move in tree.moves.values())
    if len(numbers) != count:
        raise element.fault(
            f"qpos: found {len(numbers)} numbers, expected {count}, of the joints in order; correct"
            " the attribute"
        )
    found: dict[str, Value] = {}
    for move in tree.moves.values():
        found[move.name] = _value(tree, move, numbers[: COORDINATES[move.kind]], element)
        numbers = numbers[COORDINATES[move.kind] :]
    return found


def _value(tree: Tree, move: Move, texts: Sequence[str], key: Element | None = None) -> Value:
    """Return a move's change since the zero pose from its coordinates, those of a keyframe or of
    --start.
    """

    def error(problem: str) -> CaseError:
        problem = f"{problem}; correct it"
        return key.fault(f"qpos: {problem}") if key else tree.fault("--start", problem)

    expected = COORDINATES[move.kind]
    try:
        if key is None and move.is_axial:
            units, bare = (ANGLES, "rad") if move.kind == "hinge" else (LENGTHS, "m")
            numbers = [measure(each, units, bare)[0] for each in texts]
        else:
            numbers = [decimal(each) for each in texts]
    except ValueError:
        numbers = [math.nan]
    if len(numbers) != expected or not all(map(usable, numbers)):
        raise error(
            f"found {shown(' '.join(texts))} for {move.name!r}, {with_article(move.kind)} joint,"
            f" expected {expected} finite number{'s' * (expected > 1)}"
        )
    if expected == 1:
        return numbers[0] - move.value
    if not any(numbers[-4:]):
        raise error(f"the quaternion of {move.name!r} is zero, expected one of length one")
    turn, frame = unit_quaternion(quat(numbers[-4:])), tree.moving[move.inner]
    if move.kind == "free":
        return Place(vec(numbers[:3]), turn) * frame.inverse
    # MuJoCo has the turn in the axes of the body
    turn = frame.turn * turn * frame.turn.conjugate()
    return Place(move.point - Place(turn=turn).direction(move.point), turn)


@dataclass(frozen=True)
class Driving:
    """Driven and held moves of a model.

    Attributes:
        driven: by move, its coordinates in the model, reference included [rad or m]; the first one
            is swept, the others follow it.
        held: hinges and slides with their coordinate in the start.
        fixed: balls, and otherwise free links, at their place in the start.
    """

    driven: Mapping[str, Array]
    held: tuple[str, ...]
    fixed: tuple[str, ...]

    @property
    def moves(self) -> tuple[str, ...]:
        """Driven and held hinges and slides, the swept one first."""
        return (*self.driven, *self.held)

    def beyond_limits(self, tree: Tree, near: Mapping[str, float]) -> list[str]:
        """Return a note on joints that begin or are driven beyond their limits, if there are some.

        Args:
            near: distance from a limit that counts as on it, by kind of move [rad or m].
        """
        found: list[str] = []
        for name, move in tree.joints.items():
            lower, upper = move.limit.lower, move.limit.upper
            values = self.driven.get(name, np.array([move.value]))
            low, high = float(values.min()), float(values.max())
            if move.is_axial and (low < lower - near[move.kind] or high > upper + near[move.kind]):
                reached = f"{low:.9g} to {high:.9g}" if low < high else f"{low:.9g}"
                found.append(f"{name} at {reached}, limits {lower:.9g} to {upper:.9g}")
        told = shortened(found, MOST_NAMED, "; ")
        return [f"joints beyond their limits: {told}"] if found else []


def read_driving(tree: Tree, supplied: ModelOptions) -> Driving:
    """Read --drive and --hold.

    Raises:
        CaseError: they name an unknown move, name one twice, or give different samples.
    """
    driven: dict[str, Array] = {}
    given: dict[str, int] = {}
    for text in supplied.drive:
        name, values, samples = _read_drive(tree, text)
        if name in driven:
            raise tree.fault("--drive", f"found {name!r} twice; give one range")
        driven[name] = values
        if samples is not None:
            given[name] = samples
    if len({*given.values()}) > 1:
        counts = ", ".join(f"{count} of {name!r}" for name, count in given.items())
        raise tree.fault(
            "--drive",
            f"found {counts} samples, expected as many of each; all joints move together",
        )
    for count in given.values():
        driven = {name: np.linspace(each[0], each[-1], count) for name, each in driven.items()}
    held: list[str] = []
    fixed: list[str] = []
    for name in dict.fromkeys(supplied.hold):
        if name in driven:
            raise tree.fault(
                "--hold", f"found {name!r}, which is driven, expected another joint; leave it out"
            )
        if name in tree.joints and tree.joints[name].is_axial:
            held.append(name)
        elif name in tree.joints or name in tree.free:
            fixed.append(name)
        else:
            known = [*tree.joints, *tree.free]
            raise unknown_name(tree.file, "--hold", name, known, "a joint or a free body")
    return Driving(driven, tuple(held), tuple(fixed))


def _read_drive(tree: Tree, text: str) -> tuple[str, Array, int | None]:
    """Return the move, its values, and how many were asked for; names may hold colons too."""
    form = (
        "JOINT:START:STOP or JOINT:START:STOP:SAMPLES, in the model's coordinates, rad or m unless"
        f" a unit is given, 2 to {MOST_SAMPLES} samples"
    )
    parts = text.split(":")
    named = {":".join(parts[:k]): parts[k:] for k in range(max(1, len(parts) - 3), len(parts) + 1)}
    name = next((name for name in named if name in tree.joints), None)
    if name is None:
        axial = [name for name, move in tree.joints.items() if move.is_axial]
        raise tree.fault(
            "--drive", f"found {shown(text)}, expected {form}; {remedy(next(iter(named)), axial)}"
        )
    if not tree.joints[name].is_axial:
        raise tree.fault(
            "--drive", f"{name!r} is a ball joint, expected a hinge or a slide; drive one of those"
        )
    numbers = named[name]
    if len(numbers) < 2:
        raise tree.fault(
            "--drive",
            f"found {shown(text)}, expected {form}; say from where to where: {name}:START:STOP",
        )
    turns, samples, unit = tree.joints[name].kind == "hinge", None, ""
    try:
        units, bare = (ANGLES, "rad") if turns else (LENGTHS, "m")
        (start, stop), unit = interval(numbers[:2], units, bare)
        if len(numbers) == 3:
            samples = int(numbers[2])
    except ValueError:
        start = stop = math.nan
    count = SAMPLES if samples is None else samples
    if not (math.isfinite(stop - start) and start != stop and 1 < count <= MOST_SAMPLES):
        raise tree.fault("--drive", f"found {shown(text)}, expected {form}; correct the numbers")
    if turns and not unit and (count_of := abs(stop - start) / math.tau) > MANY_TURNS:
        samples_of = "".join(f":{each}" for each in numbers[2:])
        ends = ":".join(numbers[:2])
        raise tree.fault(
            "--drive",
            f"{name} would turn {count_of:.3g} times from {start:g} to {stop:g} rad; write"
            f" {name}:{ends}deg{samples_of} for degrees, or {name}:{ends}rad{samples_of} if radians"
            " are meant",
        )
    return name, np.linspace(start, stop, count), samples


def driving_of_motors(tree: Tree, supplied: ModelOptions) -> tuple[Driving, str]:
    """Return the driving of all joints with a motor through their limits, none without limits, and
    a note on it.
    """
    limits = {name: move.limit for name, move in tree.joints.items() if name in tree.actuated}
    ranges = tuple(f"{name}:{each.lower!r}:{each.upper!r}" for name, each in limits.items())
    if not all(each.is_range for each in limits.values()):
        ranges = ()
    names = shortened([*limits], MOST_MOTORS)
    moves = (
        f"joint {names} moves through its limits, as the file has a motor there"
        if len(limits) == 1
        else f"joints {names} move through their limits, as the file has motors there"
    )
    note = f"nothing is said of what drives it: {moves}; other motions by --drive"
    return read_driving(tree, replace(supplied, drive=ranges)), note


class UndrivenMotions:
    """The motions of a model not driven or held so far.

    Attributes:
        dof: their number at the beginning.
        taken: coordinates of driven and held moves.
    """

    def __init__(self, model: Assembled, spins: Mapping[str, Array]) -> None:
        """Begin with the motions left by the ties, without the spins of rods.

        Args:
            spins: by ball or free move, the axis about which its rod turns freely, shape (3,).
        """
        self._parts = [replace(each) for each in model.free]
        self._part_of = {move: part for part in self._parts for move in part.columns}
        for name, axis in spins.items():
            part = self._part_of[name]
            part.restrict(axis[None] @ part.of(name)[:, -3:].T)
        self.dof, self.taken = self.remaining, 0

    @property
    def remaining(self) -> int:
        """Number of motions left."""
        return sum(len(each.basis) for each in self._parts)

    def sizes(self, move: str) -> Array:
        """Return how much of a move's unknowns the motions have, the most first."""
        own = self._part_of[move].of(move)
        return np.linalg.svd(own, full_matrices=False)[1] if own.size else np.zeros(0)

    def count(self, move: str) -> int:
        """Return how many of a move's motions are left."""
        return int((self.sizes(move) > AT_REST).sum())

    def can_hold(self, move: str, clearly: float) -> bool:
        """Return whether each of a move's unknowns can be held: it has more than this."""
        sizes, wanted = self.sizes(move), len(self._part_of[move].columns[move])
        return len(sizes) == wanted and bool(sizes[-1] > clearly)

    def take(self, move: str) -> None:
        """Drive or hold a move."""
        part = self._part_of[move]
        self.taken += len(part.columns[move])
        part.restrict(part.of(move).T)


def choose_held(
    model: Assembled, driving: Driving, spins: Mapping[str, Array], *, hold_rest: bool
) -> Driving:
    """Return the driving, with moves held for the rest if wanted: free links, then moves with an
    actuator, then others, then balls.

    Raises:
        CaseError: freedoms are left, more are driven and held than there are, or --hold-rest would
            hold many joints that no motor moves.
    """
    freedom, tree, named = UndrivenMotions(model, spins), model.tree, driving.held
    # a joint may have the name of a link that another one moves
    moves = {move.inner: name for name, move in tree.moves.items()} | {x: x for x in tree.moves}
    for option, names in (("--drive", driving.driven), ("--hold", driving.held + driving.fixed)):
        for name in names:
            if not freedom.count(moves[name]):
                advice = "name another" if option == "--drive" else "leave it out"
                raise tree.fault(
                    option,
                    f"found {name!r}, which an equality of the file locks, expected a joint that"
                    f" moves; {advice}, or start elsewhere by --start",
                )
    for name in (*driving.moves, *driving.fixed):
        freedom.take(moves[name])
    candidates = _candidates(tree, driving)
    if hold_rest and driving.driven:
        for clearly in (CLEARLY, AT_REST):
            for move in candidates:
                if move.name in (*driving.held, *driving.fixed):
                    continue
                if freedom.can_hold(move.name, clearly):
                    freedom.take(move.name)
                    more = (move.name,)
                    driving = (
                        replace(driving, held=driving.held + more)
                        if move.is_axial
                        else replace(driving, fixed=driving.fixed + more)
                    )
    if freedom.remaining or freedom.taken != freedom.dof or not driving.driven:
        raise _freedom_error(tree, driving, freedom)
    passive = [each for each in driving.held if each not in (*named, *tree.actuated)]
    if len(passive) > MOST_HELD:
        raise tree.fault(
            "--hold-rest",
            f"would hold {len(passive)} joints without a motor, of {freedom.dof} freedoms: does the"
            " file lack loops? If they are meant to stand still, name them: --hold"
            f" {' '.join(passive)}",
        )
    return driving


def _candidates(tree: Tree, driving: Driving) -> list[Move]:
    """Return the moves to hold, the first ones first.

    Joints without a motor come in the order of the file. If files beside a robot or names of its
    frames close it, those nearer to the base come first: most such robots have their motors there.
    """
    named = {*driving.moves, *driving.fixed}
    depths: dict[str, int] = {}
    for move in tree.moves.values():  # outer ones first
        depths[move.inner] = 0 if tree.closes else 1 + depths.get(move.outer, 0)

    def order(move: Move) -> tuple[int, int]:
        if move.is_axial:
            return (1, 0) if move.name in tree.actuated else (2, depths[move.inner])
        return (0, 0) if move.kind == "free" else (3, 0)

    loose = [move for move in tree.moves.values() if not {move.name, move.inner} & named]
    return sorted(loose, key=order)


def _freedom_error(tree: Tree, driving: Driving, freedom: UndrivenMotions) -> CaseError:
    """Return the error of a model whose degrees of freedom differ from the driven ones."""
    dof, count = freedom.dof, freedom.taken
    if dof == 0:
        return tree.fault(
            "",
            "the model cannot move from its start: no freedom is left there. Give another model, or"
            " another start by --start.",
        )
    what = f"{count} driven or held"
    if not count:
        what = f"nothing says what drives it: {_motors(tree, dof)}"
    advice: list[str] = []
    if not driving.driven:
        advice.append("--drive JOINT:START:STOP for the one that moves")
    wanted = freedom.remaining - (not driving.driven)
    if wanted > 0:
        bodies = " (a free body counts for 6, a ball for 3)" * (
            not all(move.is_axial for move in tree.moves.values())
        )
        advice.append(f"--hold JOINT for {wanted} more{bodies}, or --hold-rest")
    elif count > dof:
        advice.append(f"fewer --hold, by {count - dof}")
    if count <= dof < freedom.remaining + count:
        tied = freedom.remaining + count - dof
        advice.append(f"others for {tied} that depend on each other by the equalities")
    return tree.fault(
        "",
        f"the model has {dof} degree{'s' * (dof != 1)} of freedom, and {what}. Say"
        f" {' and '.join(advice)}.{_to_hold(_candidates(tree, driving), freedom)}",
    )


def _motors(tree: Tree, dof: int) -> str:
    """Return in words why the motors of a file do not drive it."""
    names = [name for name in tree.joints if name in tree.actuated]
    if not names:
        return "the file marks no motors"
    which = f"its motors, of {shortened(names, MOST_MOTORS)},"
    endless = [name for name in names if not tree.joints[name].limit.is_range]
    if endless:
        return f"{which} have no limits at {shortened(endless, MOST_MOTORS)}"
    if len(names) != dof:
        return f"{which} move {len(names)} of them"
    return f"{which} do without --hold-rest"


def _to_hold(candidates: Sequence[Move], freedom: UndrivenMotions) -> str:
    """Return the moves to hold, by their kinds."""
    counts = [(move, freedom.count(move.name)) for move in candidates]
    loose = [move for move, count in counts if count == UNKNOWNS[move.kind]]
    kinds = {
        "Joints, actuated ones first": [move.name for move in loose if move.is_axial],
        "Ball joints": [move.name for move in loose if move.kind == "ball"],
        "Free bodies": [move.inner for move in loose if move.kind == "free"],
    }
    if loose:
        return "".join(
            f" {what}: {shortened(names, MOST_NAMED)}." for what, names in kinds.items() if names
        )
    partly = shortened([move.name for move, count in counts if count], MOST_NAMED)
    return (
        f" These are free in part only, and cannot be held: {partly}."
        if partly
        else " None can be held."
    )
