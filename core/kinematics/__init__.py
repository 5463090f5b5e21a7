"""Kinematics: from the description of a mechanism to its motion.

This module is the door to the native solver: code outside this folder imports from here only.

Solve:

    solve              one design over a sweep
    solve_designs      many designs over a sweep, each with its own geometry
    forces_of          reactions of joints and efforts of drivers of a solved motion
    trace              a motion by its arc length, beyond lock-ups of a driver
    assemble           a closed pose from an estimate
    find_assemblies    all closed poses
    followed_angle     the angle of a joint with its turns, followed from the design
    followed_attitude  the attitude of a body with its turns, followed from the design
    count_turns        an angle known up to whole turns, from sample to sample
    residuals          what poses from elsewhere leave of the rows, and what their digits allow
    needed_forces      the forces that a motion from elsewhere needs, and what nothing holds
    NativeSolver       settings of the solver; makes a mechanism ready for a path (`prepare`) or for
                       many designs (`prepare_designs`), and tells the size of its programs

Describe:

    start_of, solve_from_start, notes_on_start      the start of the samples on a path
    degrees_of_freedom, require_driven              drivers against degrees of freedom
    reduce_rows, largest_residual                   rows that are redundant but for digits
    kinds, places, placed                           the geometry by name
    LoadPlace, load_places                          masses and loads by name
    Ranks, freeing, conditioning, describe_screws   rank, conditioning and screws at a pose
    prove, prove_pose                               samples and poses enclosed in balls
    constraints, Cartesian, Frames, Relation        the equations of joints and drivers
    continued, continuous, regular_between          tests of a step
    motion_defects                                  a motion of bodies against the constraints

The folders:

    formulation      constraints as equations, in Cartesian or joint coordinates
    structure        degrees of freedom, redundant rows, components, sparse factors
    compiled         one mechanism as compiled programs: request, programs, model, samples
    continuation     the walk along a path, step halving, singular poses, curves by arc length
    blocks           large mechanisms as lists of blocks: components, or one sparse system
    forces           the equations of forces, and the forces of a solved motion
    sparse           the equations of large mechanisms as a sparse system
    assembly         closed poses from estimates and random starts
    diagnosis        rank, conditioning and screws at a pose
    verified         samples enclosed in balls by Krawczyk's test
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .assembly.assemble import Assembled as Assembled
    from .assembly.assemble import assemble as assemble
    from .assembly.assembly_modes import Assemblies as Assemblies
    from .assembly.assembly_modes import Assembly as Assembly
    from .assembly.assembly_modes import find_assemblies as find_assemblies
    from .compiled.motion_start import Start as Start
    from .compiled.motion_start import notes_on_start as notes_on_start
    from .compiled.motion_start import solve_from_start as solve_from_start
    from .compiled.motion_start import start_of as start_of
    from .compiled.request import LAST_ITERATION as LAST_ITERATION
    from .continuation.curve import Curve as Curve
    from .continuation.curve import Event as Event
    from .continuation.trace import trace as trace
    from .design_batch import Variants as Variants
    from .design_forces import ForcesOfDesigns as ForcesOfDesigns
    from .design_sweep import Designs as Designs
    from .design_sweep import solve_designs as solve_designs
    from .diagnosis.conditioning import Conditioning as Conditioning
    from .diagnosis.conditioning import PoseConditioning as PoseConditioning
    from .diagnosis.conditioning import conditioning as conditioning
    from .diagnosis.freeing import freeing as freeing
    from .diagnosis.instantaneous_screws import Screw as Screw
    from .diagnosis.instantaneous_screws import describe_screws as describe_screws
    from .diagnosis.position_gradients import Gradient as Gradient
    from .diagnosis.rank import Blocked as Blocked
    from .diagnosis.rank import ComponentCount as ComponentCount
    from .diagnosis.rank import Dependency as Dependency
    from .diagnosis.rank import NamedRow as NamedRow
    from .diagnosis.rank import Ranks as Ranks
    from .diagnosis.rank import Violation as Violation
    from .followed_angles import in_doubt as in_doubt
    from .followed_attitudes import DOUBTFUL as DOUBTFUL
    from .followed_attitudes import agreement as agreement
    from .followed_way import near_design as near_design
    from .forces.motion_defects import motion_defects as motion_defects
    from .forces.reactions import forces_of as forces_of
    from .forces.reactions import with_forces as with_forces
    from .formulation.acceptance_criteria import LONGEST_TURN as LONGEST_TURN
    from .formulation.acceptance_criteria import ROUNDING as ROUNDING
    from .formulation.acceptance_criteria import continued as continued
    from .formulation.acceptance_criteria import continuous as continuous
    from .formulation.acceptance_criteria import regular_between as regular_between
    from .formulation.cartesian import COLUMNS as COLUMNS
    from .formulation.cartesian import Cartesian as Cartesian
    from .formulation.constraints import Frames as Frames
    from .formulation.constraints import Relation as Relation
    from .formulation.constraints import Style as Style
    from .formulation.constraints import constraints as constraints
    from .formulation.constraints import unit_near as unit_near
    from .formulation.load_parameters import LoadPlace as LoadPlace
    from .formulation.load_parameters import load_places as load_places
    from .formulation.parameters import kinds as kinds
    from .formulation.parameters import placed as placed
    from .formulation.parameters import places as places
    from .native_solver import Method as Method
    from .native_solver import NativeSolver as NativeSolver
    from .one_design import solve as solve
    from .prepared_designs import PreparedDesigns as PreparedDesigns
    from .program_size import ProgramSize as ProgramSize
    from .replay import Residuals as Residuals
    from .replay import Worst as Worst
    from .replay import count_turns as count_turns
    from .replay import judged_part as judged_part
    from .replay import replayed as replayed
    from .replay import residuals as residuals
    from .replayed_forces import Needed as Needed
    from .replayed_forces import needed_forces as needed_forces
    from .solver_selection import Solver as Solver
    from .solver_selection import followed_angle as followed_angle
    from .solver_selection import followed_attitude as followed_attitude
    from .solver_selection import follower as follower
    from .structure.driver_count import degrees_of_freedom as degrees_of_freedom
    from .structure.driver_count import require_driven as require_driven
    from .structure.reduction import largest_residual as largest_residual
    from .structure.reduction import reduce_rows as reduce_rows
    from .verified.exact import Exact as Exact
    from .verified.exact import Reading as Reading
    from .verified.exact import as_decimal as as_decimal
    from .verified.exact import as_double as as_double
    from .verified.force_enclosure import EnclosedForces as EnclosedForces
    from .verified.force_enclosure import UnprovedError as UnprovedError
    from .verified.krawczyk import Enclosure as Enclosure
    from .verified.pose_proof import PoseState as PoseState
    from .verified.pose_proof import prove_pose as prove_pose
    from .verified.verified_sweep import Drives as Drives
    from .verified.verified_sweep import Proofs as Proofs
    from .verified.verified_sweep import prove as prove

_NAMES = {
    "assembly.assemble": "Assembled assemble",
    "assembly.assembly_modes": "Assemblies Assembly find_assemblies",
    "compiled.motion_start": "Start notes_on_start solve_from_start start_of",
    "compiled.request": "LAST_ITERATION",
    "continuation.curve": "Curve Event",
    "continuation.trace": "trace",
    "design_batch": "Variants",
    "design_forces": "ForcesOfDesigns",
    "design_sweep": "Designs solve_designs",
    "diagnosis.conditioning": "Conditioning PoseConditioning conditioning",
    "diagnosis.freeing": "freeing",
    "diagnosis.instantaneous_screws": "Screw describe_screws",
    "diagnosis.position_gradients": "Gradient",
    "diagnosis.rank": "Blocked ComponentCount Dependency NamedRow Ranks Violation",
    "followed_angles": "in_doubt",
    "followed_attitudes": "DOUBTFUL agreement",
    "followed_way": "near_design",
    "forces.motion_defects": "motion_defects",
    "forces.reactions": "forces_of with_forces",
    "formulation.acceptance_criteria": "LONGEST_TURN ROUNDING continued continuous regular_between",
    "formulation.cartesian": "COLUMNS Cartesian",
    "formulation.constraints": "Frames Relation Style constraints unit_near",
    "formulation.load_parameters": "LoadPlace load_places",
    "formulation.parameters": "kinds placed places",
    "native_solver": "Method NativeSolver",
    "one_design": "solve",
    "prepared_designs": "PreparedDesigns",
    "program_size": "ProgramSize",
    "replay": "Residuals Worst count_turns judged_part replayed residuals",
    "replayed_forces": "Needed needed_forces",
    "solver_selection": "Solver followed_angle followed_attitude follower",
    "structure.driver_count": "degrees_of_freedom require_driven",
    "structure.reduction": "largest_residual reduce_rows",
    "verified.exact": "Exact Reading as_decimal as_double",
    "verified.force_enclosure": "EnclosedForces UnprovedError",
    "verified.krawczyk": "Enclosure",
    "verified.pose_proof": "PoseState prove_pose",
    "verified.verified_sweep": "Drives Proofs prove",
}
"""Module: its public names. No module of this folder has such a name: once imported, it would take
the place of the name.
"""
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    """Import a public name on first use: most callers need a few of them."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f".{_MODULES[name]}", __name__), name)
    globals()[name] = found
    return found
