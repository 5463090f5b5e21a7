"""Base class of the engines in projection mode; each adds its name, its joints and its model.

A simulator's floor is the time of its compiled code for a sample, without the surrounding Python.
Each call of the projection mode into the simulator is timed on the case's model and on the smallest
possible model; the difference is the compiled work, and the rest is Python and its binding. A
linear system is timed as LAPACK's LU with as many rows as unknowns, minus the time of one row, even
if the adapter needs least squares. Residual tests, predictor and copying do not count. So no loop
around these calls is faster than the floor, in any language.
"""

from __future__ import annotations

import importlib
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

from ...core.case.case import Case
from ...core.errors import SolveError
from ...core.harness.engine import equilibria_of
from ...core.joints import Joint
from ...core.mechanism.mechanism import replaced_joints, with_equivalents
from ...core.mechanism.motions import JointAngle, JointDisplacement, PointCoordinate
from ...core.trajectory import Trajectory
from .equivalents import in_own_frame, own_frame
from .projection import EFFORTS, solve_by_projection
from .projection_model import ProjectionModel

DRIVERS = (JointAngle, JointDisplacement, PointCoordinate)


@dataclass(frozen=True)
class ProjectionEngine(ABC):
    """An engine (see `Engine`) whose `ProjectionModel` the Newton walk solves.

    Attributes:
        corrections: number of Newton steps after the predictor, whatever the residual; None
            iterates to convergence.
        name: name on the command line, and by default of the simulator's Python package.
        package: name of the simulator's package, if it differs.
        title: name of the simulator in sentences.
        joints: supported joint types.
    """

    corrections: int | None = None
    name: ClassVar[str]
    package: ClassVar[str] = ""
    title: ClassVar[str]
    joints: ClassVar[Collection[type[Joint]]]
    mode = "projection"
    loop = "python"

    @property
    @abstractmethod
    def described(self) -> Mapping[str, Any]:
        """Return the quantities of the simulator that are used."""

    @property
    def settings(self) -> Mapping[str, Any]:
        """The quantities in use, the linear solver and the Newton steps."""
        solver = (
            "LAPACK: LU where the rows are square and of full rank at design, else least squares"
        )
        steps = {} if self.corrections is None else {"newton_steps": self.corrections}
        return {**self.described, "linear solver": solver, **steps}

    def version(self) -> str | None:
        """Return the simulator's version, or None if the import fails."""
        try:
            return self.version_of(importlib.import_module(self.package or self.name))
        except (
            Exception,
            SystemExit,
        ):  # a broken binary may raise any error, and counts as not installed
            return None

    def version_of(self, simulator: Any) -> str | None:
        """Return the version of the imported package; None if it is another package of this
        name.
        """
        return str(simulator.__version__)

    def with_known_joints(self, case: Case) -> Case:
        """Return the case with equivalents of unsupported joints."""
        found = with_equivalents(case.mechanism, self.joints)
        return case if found is case.mechanism else replace(case, mechanism=found)

    def scaled_case(self, case: Case) -> Case:
        """Return the case for the simulator: known joints, in the scaled frame."""
        return in_own_frame(self.with_known_joints(case))

    def unsupported(self, case: Case) -> str | None:
        """Return a message on the first joint or driver that has none of the known exact types, and
        no equivalent of them, or None. A subclass may have another meaning.
        """
        mechanism = self.with_known_joints(case).mechanism
        for each in (*mechanism.joints, *mechanism.drivers):
            known = self.joints if isinstance(each, Joint) else DRIVERS
            if type(each) not in known:
                driver = f"driver {each.name!r} ({each.type})"
                return (
                    f"{each if isinstance(each, Joint) else driver} has no counterpart in"
                    f" {self.title} here; known: {', '.join(kind.type for kind in known)}"
                )
        return None

    @abstractmethod
    def model_of(self, case: Case) -> ProjectionModel:
        """Return the simulator's model of the unscaled case, at the design position."""

    def build(self, case: Case) -> ProjectionModel:
        """Return the simulator's model of the case in the scaled frame, at the design position."""
        return self.model_of(self.scaled_case(case))

    def solve(self, model: ProjectionModel, case: Case, tol: float) -> Trajectory:
        """Solve all samples; see `Engine.solve`.

        Raises:
            SolveError: the model was built for another mechanism, other points, or a sweep whose
                length gives another unit of length.
        """
        replaced = replaced_joints(case.mechanism, self.joints)
        case = self.with_known_joints(case)
        own = in_own_frame(case)
        # The model has no names, so results of another mechanism could be mistaken for this one's.
        built = model.case
        if (own.mechanism, own.points, own.forces) != (built.mechanism, built.points, built.forces):
            raise SolveError(
                f"case {case.name!r}: this model of {self.title} was built for another mechanism,"
                f" other points, other forces or another length of the sweep (case {built.name!r});"
                " build a model for this case"
            )
        details = {**model.details, **({"equivalents": replaced} if replaced else {})}
        return solve_by_projection(model, case, tol, details, self.corrections, own_frame(case))

    def equilibria(self, case: Case) -> Trajectory:
        """Return the equilibria of a case; see `harness.engine.Balancing`."""
        return equilibria_of(self, case, "projection")

    def efforts(self) -> Mapping[str, Self]:
        """Return the efforts by the number of Newton steps."""
        return {label: type(self)(corrections) for label, corrections in EFFORTS.items()}
