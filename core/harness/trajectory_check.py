"""Checks of an engine's trajectory: its form by the engine protocol, and what it says of itself:
the balance of power, and bodies that keep the constraints.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..case.case import HELD_BUT, Case, Series, pace, size
from ..case.held import held_case
from ..case.measures import ForceMeasure
from ..errors import KincheckError
from ..forces import BALANCED, Forces
from ..trajectory import QUANTITIES, Array, BodyMotion, Trajectory
from ..unit_text import value_text


class Reported(Trajectory):
    """Outputs as an engine reports them: of a recording, of a foreign program.

    Attributes:
        outputs: by name; NaN at samples without a value. Their uncertainty is that of printed
            digits, and adds to the tolerance.
        faults: what the engine finds wrong with them by itself, in sentences.
        judged: whether it judged them by itself, so that they can pass without a standard.
    """

    outputs: Mapping[str, Series]
    faults: Sequence[str]
    judged: bool

    def __init__(
        self,
        count: int,
        outputs: Mapping[str, Series],
        residual: float = 0.0,
        *,
        faults: Sequence[str] = (),
        judged: bool = False,
        details: Mapping[str, Any] | None = None,
        solved: NDArray[np.bool_] | None = None,
        message: str = "",
    ) -> None:
        known = np.ones(count, dtype=np.bool_) if solved is None else solved
        none = np.zeros(count, dtype=np.int64)
        super().__init__({}, known, none, residual, message=message, details=details)
        self.__dict__.update(outputs=outputs, faults=faults, judged=judged)


Mask: TypeAlias = NDArray[np.bool_]
CONSTRAINED = 1e-9
"""Largest defect of a motion of bodies in the constraints, relative to the mechanism's size and its
constraints' rates: the default tolerance of outputs, and ten thousand times the round-off.
"""
KINDS = {"f": "floats", "b": "booleans", "iu": "whole numbers", "fiu": "a real number"}
"""Words for the expected numbers, by kinds of numpy."""


class BadTrajectoryError(KincheckError):
    """An engine's answer violates the engine protocol."""


def check(case: Case, engine: str, trajectory: Trajectory) -> None:
    """Check an answer against the engine protocol.

    Raises:
        BadTrajectoryError: a point is missing, a shape or a kind of number is wrong, a solved
            sample is not finite, a residual is negative, or bodies are missing.
    """
    given: Any = trajectory  # may be anything
    if not isinstance(given, Trajectory):
        raise BadTrajectoryError(
            f"{engine}: solve returned {type(given).__name__}, expected a Trajectory"
        )
    if isinstance(trajectory, Reported):
        return
    try:
        _check_form(case, trajectory)
    except BadTrajectoryError as error:
        raise BadTrajectoryError(f"{engine}: {error}") from None


def _check_form(case: Case, trajectory: Trajectory) -> None:
    n = len(case.sweep.values)
    solved = _numbers("solved", trajectory.solved, (n,), "b")
    iterations = _numbers("iterations", trajectory.iterations, (n,), "iu")
    if (iterations < 0).any():
        raise BadTrajectoryError(f"iterations has {iterations.min()}, expected no negative number")
    residual = _numbers("residual", trajectory.residual, (), "fiu")
    if solved.any() and not (np.isfinite(residual) and residual >= 0.0):
        raise BadTrajectoryError(
            f"residual is {residual} although {solved.sum()} samples are called solved, expected"
            " the largest absolute value of their constraints"
        )
    facts: Any = (trajectory.message, trajectory.details)
    if not isinstance(facts[0], str) or not isinstance(facts[1], Mapping):
        raise BadTrajectoryError(
            f"message is {facts[0]!r} and details {facts[1]!r}, expected a text and a mapping"
        )
    for point in case.points:
        if point not in trajectory.points:
            raise BadTrajectoryError(
                f"no motion of point {point!r}; found: {', '.join(trajectory.points) or 'none'}"
            )
        motion = trajectory.points[point]
        for quantity in QUANTITIES:
            values: Array | None = getattr(motion, quantity)
            if values is None and quantity != "position":
                continue
            what = f"{quantity} of point {point!r}"
            _require_finite(case, what, _numbers(what, values, (n, 3)), solved)
    _check_bodies(case, trajectory.bodies, solved)
    if trajectory.forces is not None:
        _check_forces(trajectory.forces, n)


def _check_bodies(case: Case, bodies: Mapping[str, BodyMotion], solved: Mask) -> None:
    """Check motions of bodies: of all moving bodies or of none, since the constraints judge them
    together.
    """
    moving, n = {body.name for body in case.mechanism.moving}, len(solved)
    if bodies and (apart := sorted(moving ^ {*bodies})):
        raise BadTrajectoryError(
            f"motions of bodies {', '.join(bodies)}, but {apart[0]!r} is"
            f" {'missing' if apart[0] in moving else 'no moving body'}. Give those of all moving"
            " bodies, or none."
        )
    for name, motion in bodies.items():
        for key, columns in (("r", 3), ("p", 4), ("v", 6), ("a", 6)):
            values: Array | None = getattr(motion, key)
            if values is not None or key in "rp":
                what = f"{key} of body {name!r}"
                _require_finite(case, what, _numbers(what, values, (n, columns)), solved)
        length = np.linalg.norm(np.asarray(motion.p)[solved], axis=1)
        if (off := np.abs(length - 1.0).max(initial=0.0)) > CONSTRAINED:
            raise BadTrajectoryError(
                f"p of body {name!r} has length {1.0 + off:.9g}, expected Euler parameters of"
                " length 1"
            )


def _check_forces(forces: Forces, n: int) -> None:
    """Check the form of forces: NaN is allowed where a force is missing or undetermined."""
    given: dict[str, tuple[Any, tuple[int | None, ...]]] = {
        "power": (forces.power, (n,)),
        "largest_power": (forces.largest_power, (n,)),
    }
    for name, each in forces.joints.items():
        given |= {
            f"force of joint {name!r}": (each.force, (n, 3)),
            f"moment of joint {name!r}": (each.moment, (n, 3)),
            f"free directions of joint {name!r}": (each.free, (n, 6, None)),
        }
    given |= {f"effort of driver {name!r}": (x, (n,)) for name, x in forces.drivers.items()}
    given |= {f"force of element {name!r}": (x, (n,)) for name, x in forces.elements.items()}
    for what, (values, shape) in given.items():
        if np.isinf(_numbers(what, values, shape)).any():
            raise BadTrajectoryError(f"{what} is infinite. Give finite numbers, or NaN for none.")


def _numbers(what: str, values: Any, shape: tuple[int | None, ...], kinds: str = "f") -> Any:
    """Return an array of the expected shape (None: any) and kind of number."""
    try:
        found = np.asarray(values)
    except ValueError as error:  # rows of different lengths
        raise BadTrajectoryError(f"{what} is no array: {error}") from None
    if found.dtype.kind not in kinds:
        raise BadTrajectoryError(f"{what} is of {found.dtype}, expected {KINDS[kinds]}")
    sizes = zip(found.shape, shape, strict=False)
    if len(found.shape) != len(shape) or any(b not in (a, None) for a, b in sizes):
        expected = tuple("any" if each is None else each for each in shape)
        raise BadTrajectoryError(f"{what} has shape {found.shape}, expected {expected}")
    return found


def _require_finite(case: Case, what: str, values: Array, solved: Mask) -> None:
    bad = np.flatnonzero(solved & ~np.isfinite(values).all(axis=1))
    if bad.size:
        raise BadTrajectoryError(
            f"{what} is {values[bad[0]].tolist()} at {_at(case, int(bad[0]))}, which is called"
            f" solved; {bad.size} of {len(values)} samples are so: mark them unsolved and explain,"
            " or give finite numbers"
        )


def _at(case: Case, sample: int) -> str:
    return f"sample {sample} ({case.sweep.driver} = {case.sweep.values[sample]:.9g})"


def faults(case: Case, trajectory: Trajectory, *, rigid: bool) -> Iterator[str]:
    """Yield a sentence on a missing balance of power, and on bodies that break the constraints.

    Args:
        rigid: whether the engine keeps all constraints; a simulation may not.
    """
    solved = np.asarray(trajectory.solved, dtype=np.bool_)
    if trajectory.forces is not None:
        allowed = balance_tolerance(case, trajectory.forces, solved)
        missing = np.where(solved, np.nan_to_num(np.abs(trajectory.forces.power)), 0.0)
        if missing.max(initial=0.0) > allowed:
            worst = int(np.argmax(missing))
            off, most = (value_text(f"{x:.3g}", "W") for x in (missing[worst], allowed))
            yield (
                f"the balance of power is off by {off} at {_at(case, worst)}, tolerance {most}: the"
                " drivers' power must be stored or dissipated, so a force or a rate is wrong"
            )
    if trajectory.bodies and solved.any() and rigid:
        from ..kinematics import motion_defects

        found = motion_defects(case.mechanism, case.sweep.path, trajectory)
        where, off = max(found.items(), key=lambda each: each[1].max())
        if off.max() > CONSTRAINED:
            sample = int(np.flatnonzero(solved)[np.argmax(off)])
            yield (
                f"the motion of bodies is off by {off.max():.3g} of the mechanism's size and pace"
                f" in the {where} at {_at(case, sample)}, tolerance {CONSTRAINED:g}"
            )


def balance_tolerance(case: Case, forces: Forces, solved: Mask) -> float:
    """Return the largest accepted missing power [W].

    It is a part of the largest power, and what the tolerances of forces leave at the drivers' pace.
    """
    paced, left = pace(case), [0.0]
    for output in case.outputs:
        if (
            isinstance(output, ForceMeasure)
            and not output.follows_points
            and forces.has(output.forces)
        ):
            values = output.values(forces)
            known = values[np.isfinite(values)]
            lever = 1.0 if output.turns else size(case)
            if known.size:
                tolerance = output.atol + output.rtol * float(np.ptp(known))
                left.append(paced * lever * (tolerance + BALANCED * float(np.abs(known).max())))
    largest = np.where(solved, np.nan_to_num(forces.largest_power), 0.0).max(initial=0.0)
    return BALANCED * float(largest) + max(left)


# Largest difference of a pose reached on two paths, over the mechanism's size: larger than any
# tolerance, smaller than the distance of two assemblies.
SAME_POSE = 1e-6


def held_trajectories(
    case: Case, mode: str, found: Trajectory, solve: Callable[[Case], Trajectory]
) -> tuple[dict[tuple[str, ...], Trajectory], str]:
    """Return the poses of a trajectory with velocities caused by some drivers while the others are
    at rest, by these drivers, and the reasons for missing samples.

    There is none if no output needs it, or if the engine steps through time: its velocities then
    belong to its own path.

    Args:
        mode: mode of the engine.
        solve: solves another case with the engine.
    """
    wanted = [tuple(o.facts[HELD_BUT]) for o in case.outputs if HELD_BUT in o.facts]
    held, reasons = dict[tuple[str, ...], Trajectory](), list[str]()
    for by in dict.fromkeys(wanted) if mode == "projection" else ():
        held[by], why = _held(case, by, found, solve)
        reasons += [why] if why else []
    return held, "; ".join(reasons)


def _held(
    case: Case, by: tuple[str, ...], found: Trajectory, solve: Callable[[Case], Trajectory]
) -> tuple[Trajectory, str]:
    held = solve(held_case(case, by))
    off = [
        np.abs(held.points[name].position - found.points[name].position).max(axis=1)
        for name in case.points
    ]
    same = np.nan_to_num(np.max(off, axis=0), nan=np.inf) <= SAME_POSE * size(case)
    solved = held.solved & same
    lost = int((np.asarray(found.solved) & ~solved).sum())
    why = held.message or "another assembly was found there"
    return (
        replace(held, solved=solved),
        f"no derivative by {' and '.join(by)} at {lost} of {len(same)} samples: {why}"
        if lost
        else "",
    )
