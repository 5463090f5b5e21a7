"""All reactions and efforts of a case as outputs."""

from __future__ import annotations

from dataclasses import replace

from ..case.case import TIME, Case, Series, Truth, pace, size
from ..case.io.outputs import default, largest_load
from ..case.measures import (
    Axis,
    DriverEffort,
    ElementForce,
    ForceMeasure,
    JointForce,
    JointMoment,
)
from ..case.quantity import with_markers
from ..errors import KincheckError
from ..harness.native_engine import NativeEngine
from ..mechanism.motions import Slowed


def with_reactions(case: Case, tol: float) -> Case:
    """Return the case with every determined reaction and effort as outputs, before its own.

    The native engine tells the determined components. `assembly` gets a line for each joint with
    others.

    Raises:
        KincheckError: the case has no masses and no force elements.
    """
    mechanism = case.mechanism
    if not mechanism.has_loads:
        remedy = "Give bodies mass, center_of_mass and inertia, or add [forces.NAME]."
        if case.hardpoints:
            remedy = f"Write a case file, kincheck import TABLE > case.toml, and there: {remedy}"
        raise KincheckError(
            f"{case.name}: no body has mass and no force element acts, so all reactions are zero."
            f" {remedy}"
        )
    load = largest_load(mechanism, size(case), pace(case))
    scales = {False: default(load, "N"), True: default(load * size(case), "N m")}
    every: list[ForceMeasure] = []
    for joint in mechanism.given_joints:
        for axis in Axis:
            force, moment = (f"{joint.name}.{what}_{axis}" for what in ("force", "moment"))
            every.append(JointForce(force, *scales[False], joint=joint.name, component=axis))
            every.append(JointMoment(moment, *scales[True], joint=joint.name, component=axis))
    every += [
        DriverEffort(f"{each.name}.effort", *scales[each.turns], driver=each.name)
        for each in mechanism.drivers
    ]
    every += [
        ElementForce(f"{each.name}.force", *scales[False], force=each.name)
        for each in mechanism.forces
    ]
    bound = [each.bound(mechanism) for each in every]
    # forces before moments, as the columns of the table
    bound = [replace(each, atol=scales[each.turns][0]) for each in sorted(bound, key=_turns)]
    known = {output.name for output in case.outputs}
    asked = replace(case, mechanism=with_markers(mechanism, bound), outputs=tuple(bound))
    engine = NativeEngine()
    found = engine.solve(engine.build(asked), asked, tol)
    if found.forces is None:
        return replace(case, outputs=(*bound, *case.outputs))
    forces = found.forces
    left_out = {each.name: each.undetermined(forces) for each in bound if each.undetermined(forces)}
    kept = [each for each in bound if each.name not in {*left_out, *known}]
    notes = list[str]()
    for joint in mechanism.given_joints:
        names = [name for name in left_out if name.startswith(f"{joint.name}.")]
        if names:
            parts = ", ".join(name.removeprefix(f"{joint.name}.") for name in names)
            notes.append(f"joint {joint.name!r}: redundant rows leave {parts} undetermined")
    return replace(
        case,
        mechanism=with_markers(mechanism, kept),
        outputs=(*kept, *case.outputs),
        assembly=(*case.assembly, *notes),
    )


def without_motion(case: Case) -> Case:
    """Return the case at rest at every sample. References of rates and of forces are those of a
    motion, and left out.
    """
    forces = {output.name for output in case.outputs if output.forces}
    reference = {
        name: Series(each.position, uncertainty=each.uncertainty)
        for name, each in case.reference.items()
        if name not in forces
    }
    sweep, motions = case.sweep, case.sweep.motions
    if sweep.driver != TIME and sweep.rate not in (0.0, 1.0):  # the same poses as at its rate
        motions = {name: Slowed(motion, sweep.rate) for name, motion in motions.items()}
    note = "at rest: references of forces are of the motion, and left out"
    return replace(
        case,
        sweep=replace(sweep, rate=0.0, motions=motions),
        reference=reference,
        truth=case.truth if reference else Truth.CONSENSUS_ONLY,
        assembly=(*case.assembly, *([note] if forces & {*case.reference} else [])),
    )


def _turns(each: ForceMeasure) -> bool:
    return each.turns
