"""Outputs of many designs of a case over its sweep, and their slopes by the geometry.

The equations of the outputs are part of the compiled programs. What only a whole sweep tells is
added here: turns of angles, signs of Euler parameters, and samples at rest.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...case.case import HELD_BUT, Case, Quantity
from ...case.measures import ForceMeasure, JointAngle, Orientation
from ...case.quantity import ORDERS, where_moving
from ...case.turns import Completion, over_sweep
from ...jet import Jet
from ...kinematics import NativeSolver, WantedOutput
from ...kinematics.compiled.request import OUTPUT, RESTING
from ...kinematics.compiled.routes import Route
from ...mechanism.motions import Path
from ...trajectory import QUANTITIES, Array
from ..slopes.slopes import Slope, derivatives
from .design_batch import RECYCLED, Variants, slopes_of
from .design_forces import ForcesOfDesigns, moved_forces
from .prepared import PreparedDesigns, prepare_designs

TOL = 1e-12
"""Largest accepted residual, relative to the mechanism's size, as in `kincheck run`."""
# Designs solved at once: enough to make the cost of the calls for their outputs negligible.
# `solve_designs` has no outputs, and is as fast with a quarter of them.
TOGETHER = 1024
# With fewer at once, the calls around them would be felt.
FEWEST = 8
NO_GAPS = Jet(0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class DesignOutputs:
    """A case made ready for many designs, as one program with its outputs.

    Attributes:
        outputs: of the case, by name.
        derivatives: highest kept time derivative of each output.
        sloped: how many of value, rate and second rate have slopes, by output.
    """

    case: Case
    outputs: Mapping[str, Quantity]
    derivatives: Mapping[str, int]
    sloped: Mapping[str, int]
    designs: PreparedDesigns
    path: Path

    @classmethod
    def of(
        cls,
        case: Case,
        varied: Collection[str],
        *,
        derivative: int = 0,
        slopes: Mapping[str, int] = MappingProxyType({}),
        bodies: Sequence[str] = (),
    ) -> DesignOutputs:
        """Return a case with a compiled model.

        Args:
            varied: varied places, see `prepare_designs`.
            derivative: highest wanted time derivative; outputs have theirs as far as it is known.
            slopes: of how many of value, rate and second rate the slopes by the varied places are
                wanted, by output.
            bodies: names of those whose poses are wanted.

        Raises:
            SolveError: drivers and degrees of freedom do not match, or the mechanism does not close
                at the design position.
        """
        outputs = {each.name: each for each in case.outputs}
        derivatives = {
            # turns and signs are told by rates
            name: max(derivative, 1)
            if isinstance(each, JointAngle | Orientation)
            else min(derivative, each.orders - 1)
            for name, each in outputs.items()
        }
        wanted = [
            WantedOutput(
                equation_of(each),
                derivatives[name],
                tuple(each.facts.get(HELD_BUT, ())),
                slopes.get(name, 0),
            )
            for name, each in outputs.items()
            if not each.forces
        ]
        # an output with one derivative less is a quotient of velocities; with two less it contains
        # derivatives of velocities. Rates by drivers that move alone are solved beside.
        orders = [
            ORDERS - outputs[each.equation.name].orders + each.derivative
            for each in wanted
            if not each.alone
        ]
        designs = prepare_designs(
            NativeSolver(order=max(orders, default=0)),
            case.mechanism,
            case.sweep.path,
            tuple(varied),
            forces=case.forces,
            bodies=bodies,
            outputs=wanted,
            force_slopes=any(outputs[name].forces for name in slopes),
        )
        return cls(case, outputs, derivatives, slopes, designs, case.sweep.path)

    def on_path(self, path: Path) -> DesignOutputs:
        """Return the same program on another path of the same drivers."""
        route = Route(self.designs.route.model, path)
        return replace(self, designs=replace(self.designs, route=route), path=path)

    @property
    def at_once(self) -> int:
        """The number of designs to solve together: the table of their motions fits in recycled
        memory.
        """
        of_a_design = 8 * self.designs.route.model.kept * len(self.path.times)
        return max(FEWEST, min(TOGETHER, RECYCLED // of_a_design))

    def solve(self, geometry: Array, tol: float = TOL, *, alone: bool = True) -> SolvedDesigns:
        """Solve designs at all samples.

        Args:
            geometry: numbers of the varied places in their order, shape (numbers, V).
            tol, alone: see `PreparedDesigns.solve`.
        """
        return SolvedDesigns(self, geometry, tol, self.designs.solve(geometry, tol, alone=alone))


def equation_of(output: Any) -> Any:
    """Return an output without numbers on which its equation does not depend, so that designs share
    programs: tolerances, and a radius beside the point that it leads to.
    """
    kept = dict[str, Any]()
    for name in getattr(output, "__dataclass_fields__", ()):  # of the user's, perhaps none
        value = getattr(output, name)
        if name in ("atol", "rtol", "why"):
            kept[name] = type(value)()
        elif name == "of_output":
            kept[name] = equation_of(value)
        elif getattr(value, "wheel_contact", None) is not None:
            kept[name] = replace(value, wheel_radius=1.0)
    return replace(output, **kept) if kept else output


@dataclass(frozen=True, eq=False)
class SolvedDesigns:
    """The outputs of V designs over n samples.

    Attributes:
        geometry: of the designs.
        found: their motion.
    """

    ready: DesignOutputs
    geometry: Array
    tol: float
    found: Variants
    _completions: dict[str, Completion] = field(default_factory=dict[str, Completion])
    _still: dict[int, Array | None] = field(default_factory=dict[int, Array | None])

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Whether each sample of each design was reached, shape (n, V)."""
        return self.found.solved

    @cached_property
    def _forces(self) -> ForcesOfDesigns | None:
        return self.ready.designs.forces(self.found, self.geometry, self.tol)

    def pose(self, body: str) -> Array:
        """Return origin [m] and Euler parameters of a body that was asked for, shape (7, n, V)."""
        return np.concatenate([self._kept(f"{each} {body}") for each in "rp"])

    def values(self, name: str, derivative: int = 0) -> Array:
        """Return an output, or a kept time derivative of it, shape (n, V); NaN where it has no
        value.
        """
        output = self.ready.outputs[name]
        if isinstance(output, ForceMeasure):
            assert self._forces is not None  # the case asks for them
            return self._forces.read(output.values)
        if isinstance(output, Orientation) or output.period:
            with np.errstate(all="ignore"):  # unknown numbers are NaN, and so is all they give
                jet = self._completed(name)(self._terms(name))
            values = np.asarray((jet.x, jet.v, jet.a)[derivative])
        else:
            (values,) = self._kept(f"{OUTPUT}{QUANTITIES[derivative]} {name}")
            if (gaps := self._gaps(name)) is not None:
                values = values + gaps
        known = np.isfinite(values)
        return values if known.all() else np.where(known, values, np.nan)

    def slopes(self, towards: Array) -> Iterator[tuple[str, int, Array]]:
        """Yield the outputs whose slopes are wanted, and their time derivatives by order, with
        their derivatives by motions of the geometry, drivers held, shape (motions, n, V); NaN where
        an output has no value.

        Args:
            towards: motions of the varied numbers, shape (numbers, motions).
        """
        sloped, route, outputs = self.ready.sloped, self.ready.designs.route, self.ready.outputs
        if not sloped:
            return
        moved = dict[str, Array]()
        if route.model.request.slopes:  # of forces that cannot be traced there are none
            moved = slopes_of(route, self.found, self.geometry, towards)
        measures = {
            name: each for name in sloped if isinstance(each := outputs[name], ForceMeasure)
        }
        carried = {name: np.empty((towards.shape[1], *self.solved.shape)) for name in measures}
        for k in range(towards.shape[1]) if measures else ():
            forces = moved_forces(route, self.found, {name: x[k] for name, x in moved.items()})
            for name, measure in measures.items():
                carried[name][k] = forces.read(measure.values)
        for name, count in sloped.items():
            for order in range(count):
                slopes = carried[name] if name in measures else self._moved(name, order, moved)
                yield name, order, np.where(np.isfinite(self.values(name, order)), slopes, np.nan)

    def _moved(self, name: str, order: int, moved: Mapping[str, Array]) -> Array:
        vectors = [moved[f"{OUTPUT}{label} {name}"] for label in QUANTITIES[: order + 1]]
        if not isinstance(self.ready.outputs[name], Orientation):
            return vectors[order][:, 0]
        e, terms = list[Jet](), self._terms(name)
        for k, each in enumerate(terms):
            known = [
                Slope(x, by[:, k]) for x, by in zip((each.x, each.v, each.a), vectors, strict=False)
            ]
            e.append(Jet(*known, *[np.nan] * (ORDERS - len(known))))
        with np.errstate(all="ignore"):
            jet = self._completed(name)(e)
        return np.asarray(derivatives((jet.x, jet.v, jet.a)[order]))

    def _kept(self, name: str) -> Array:
        """Return the numbers of a vector, shape (numbers, n, V)."""
        return self.found.kept[self.ready.designs.route.model.rows[name]]

    def _terms(self, name: str) -> list[Jet]:
        labels = QUANTITIES[: self.ready.derivatives[name] + 1]
        known = [self._kept(f"{OUTPUT}{label} {name}") for label in labels]
        unknown = [np.broadcast_to(np.nan, known[0].shape)] * (ORDERS - len(known))
        return [Jet(*each) for each in zip(*known, *unknown, strict=True)]

    def _completed(self, name: str) -> Completion:
        if name not in self._completions:
            ready, terms = self.ready, self._terms(name)
            mechanism, output = ready.case.mechanism, ready.outputs[name]
            self._completions[name] = over_sweep(mechanism, ready.path, output, terms, None)
        return self._completions[name]

    def _gaps(self, name: str) -> Array | None:
        """Return NaN at samples where an output has no value at rest, zero at others; None if there
        are none. Many outputs have the same speeds.
        """
        rows = self.ready.designs.route.model.rows.get(f"{RESTING}{name}")
        if rows is None:
            return None
        if rows.start not in self._still:
            own, fastest = self.found.kept[rows]
            gaps = where_moving(NO_GAPS, (own, fastest))
            self._still[rows.start] = None if gaps is NO_GAPS else np.asarray(gaps.x)
        return self._still[rows.start]
