"""A mechanism made ready to be swept: its rows selected, its programs traced, its lanes laid out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import SolveError
from ..mechanism import Mechanism
from ..program import NumpyExecutor, Program
from ..trajectory import Array
from .programs import RATE, RATE_T, Request, Tracer


def compile_model(mechanism: Mechanism, request: Request) -> Model:
    """Select the rows and trace the programs that the request needs.

    Raises:
        SolveError: drivers and degrees of freedom do not match, or the mechanism does not close at the design position.
    """
    tracer = Tracer(mechanism, request)
    # a march needs v and a where it goes on; the outputs need them only up to the order asked for
    programs = [tracer.newton(), tracer.predict(), tracer.motion("tangent", 2)]
    if request.order:
        programs.append(tracer.motion("motion", request.order))
    return Model(tracer, [*programs, tracer.outputs()])


class Model:
    """The programs of a mechanism and the blocks of lanes they run on.

    Attributes:
        slots: name of a scalar -> its place in a lane.
        vectors: name of a vector -> the places of its components.
        state: the places of everything that fixes the configuration.
    """

    def __init__(self, tracer: Tracer, programs: Sequence[Program]) -> None:
        self.mechanism, self.request, self.selection, self.frame = (
            tracer.mechanism,
            tracer.request,
            tracer.selection,
            tracer.frame,
        )
        self.programs: Mapping[str, Program] = {program.name: program for program in programs}
        self.slots, self.vectors = tracer.layout.slots, tracer.layout.vectors
        self._at_design = tracer.formulation.design
        self.state = np.array([slot for name in self._at_design for slot in self.vectors[name]])
        self._executors: dict[int, NumpyExecutor] = {}
        angle = self.mechanism.driver(self.request.driver).type == "joint_angle"
        self._drive_scale = 1.0 if angle else 1.0 / self.frame.unit
        self._design = self._solve_design()

    @property
    def sizes(self) -> dict[str, dict[str, int]]:
        """Operations and flops per lane of each program."""
        return {name: {"operations": len(each.nodes), "flops": each.flops} for name, each in self.programs.items()}

    def executor(self, lanes: int) -> NumpyExecutor:
        """The programs bound to a block of that many lanes; kept, because binding costs as much as running."""
        if lanes not in self._executors:
            self._executors[lanes] = NumpyExecutor(self.programs.values(), np.zeros((len(self.slots), lanes)))
        return self._executors[lanes]

    def drive(self, block: Array, values: Array, rate: float) -> None:
        """Set the swept driver in the lanes of a block, shape (slots, lanes), to values from the design [m or rad]."""
        block[self.slots["c"]] = self._drive_scale * values
        block[self.slots["c_t"]] = self._drive_scale * rate
        block[self.slots["half_cos"]] = np.cos(0.5 * values)
        block[self.slots["half_sin"]] = np.sin(0.5 * values)

    def design(self, rate: float) -> Array:
        """The lane of the design position moving at the given rate, shape (slots,)."""
        lane = self._design.copy()
        # at constant rate, velocities are linear in it and accelerations quadratic
        lane[self.vectors[RATE]] *= rate
        lane[self.vectors[RATE_T]] *= rate * rate
        return lane

    def _solve_design(self) -> Array:
        """The pose with all drivers at their design value, with v and a at unit rate; normally the design itself."""
        executor = NumpyExecutor(self.programs.values(), np.zeros((len(self.slots), 1)))
        block = executor.block
        for name, value in self._at_design.items():
            block[self.vectors[name], 0] = value
        self.drive(block, np.zeros(1), 1.0)
        residual = block[self.slots["residual"]]
        for _ in range(50):  # a rod given longer or shorter than its design distance is taken up here
            executor.run("newton")
            if not residual[0] > 1e-12 or not np.isfinite(block).all():
                break
        executor.run("outputs")
        closure = float(block[self.slots["closure"], 0])
        if not (closure <= 1e-12 and block[self.slots["branch"], 0] > 0.0):
            raise SolveError(
                f"mechanism {self.mechanism.name!r} does not close at the design position: residual "
                f"{closure * self.frame.unit:.3g} m after Newton's iteration, expected 0; check points, axes and lengths"
            )
        executor.run("tangent")
        return block[:, 0].copy()
