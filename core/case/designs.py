"""Outputs of many designs of a case over its sweep, and their slopes by the geometry.

The equations of the outputs are part of the compiled programs. What only a whole sweep tells is
added here: turns of angles, signs of Euler parameters, and samples at rest.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..jet import Jet
from ..kinematics import NativeSolver, PreparedDesigns, Variants, WantedOutput
from ..mechanism.motions import Path
from ..trajectory import Array
from .case import HELD_BUT, Case, Quantity
from .quantity import ORDERS
from .turns import over_sweep

TOL = 1e-12
"""Largest accepted residual, relative to the mechanism's size, as in `kincheck run`."""


@dataclass(frozen=True, eq=False)
class DesignOutputs:
    """The outputs of a case made ready for many designs, as one program.

    Attributes:
        outputs: outputs of motion by name.
        derivatives: highest kept time derivative of each.
        designs: the mechanism with its outputs.
    """

    case: Case
    outputs: Mapping[str, Quantity]
    derivatives: Mapping[str, int]
    designs: PreparedDesigns
    path: Path

    @classmethod
    def of(
        cls,
        case: Case,
        varied: Sequence[str],
        *,
        derivative: int = 0,
        slopes: bool = False,
        forces: Collection[str] = (),
        bodies: Sequence[str] = (),
    ) -> DesignOutputs:
        """Return the outputs of motion of a case, with a compiled model.

        Args:
            varied: varied places, see `NativeSolver.prepare_designs`.
            derivative: highest wanted time derivative; outputs have theirs as far as it is known.
            slopes: whether slopes by the varied places are wanted.
            forces, bodies: names of those whose forces or poses are wanted.

        Raises:
            SolveError: drivers and degrees of freedom do not match, or the mechanism does not close
                at the design position.
        """
        outputs = {each.name: each for each in case.outputs if not each.forces}
        derivatives = {name: min(derivative, each.orders - 1) for name, each in outputs.items()}
        wanted = [
            WantedOutput(each, derivatives[name], tuple(each.facts.get(HELD_BUT, ())))
            for name, each in outputs.items()
        ]
        # an output with one derivative less is a quotient of velocities; with two less it contains
        # derivatives of velocities. Rates of drivers that move alone are solved beside.
        orders = [
            ORDERS - each.equation.orders + each.derivative for each in wanted if not each.alone
        ]
        designs = NativeSolver(order=max(orders, default=0)).prepare_designs(
            case.mechanism,
            case.sweep.path,
            varied,
            forces=forces,
            bodies=bodies,
            outputs=wanted,
            slopes=slopes,
        )
        return cls(case, outputs, derivatives, designs, case.sweep.path)

    def on_path(self, path: Path) -> DesignOutputs:
        """Return the same program on another path of the same drivers."""
        return replace(self, designs=self.designs.on_path(path), path=path)

    def jets(self, found: Variants, name: str) -> Jet:
        """Return an output of solved designs with its kept derivatives, shape (n, V); NaN where it
        has none.
        """
        orders = range(self.derivatives[name] + 1)
        known = [self.designs.output(found, name, order) for order in orders]
        terms = [
            Jet(*each, *(np.nan,) * (2 - len(orders) + 1)) for each in zip(*known, strict=True)
        ]
        return self._completed(found, name, terms)

    def slopes(self, found: Variants, geometry: Array, towards: Array) -> dict[str, Array]:
        """Return the derivatives of all outputs of solved designs by motions of the geometry,
        drivers held, shape (motions, n, V); see `PreparedDesigns.slopes`.
        """
        result = dict[str, Array]()
        for name, by_motion in self.designs.slopes(found, geometry, towards).items():
            values = self.designs.output(found, name)
            slopes = [
                self._completed(
                    found, name, [Jet(x, v, np.nan) for x, v in zip(values, each, strict=True)]
                ).v
                for each in by_motion
            ]
            result[name] = np.stack(slopes) if slopes else np.empty((0, *found.solved.shape))
        return result

    def _completed(self, found: Variants, name: str, terms: Sequence[Jet]) -> Jet:
        resting = self.designs.resting(found, name)
        with np.errstate(all="ignore"):  # unknown numbers are NaN, and so is all they give
            return over_sweep(self.case.mechanism, self.path, self.outputs[name], terms, resting)
