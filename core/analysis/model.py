"""A mechanism made ready to be swept: its rows selected, its programs traced, its lanes laid out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import SolveError
from ..mechanism import Mechanism
from ..program import Executor, LlvmCode, LlvmExecutor, NumpyExecutor, Plan, Program
from ..program.compiled import available
from ..trajectory import Array
from .programs import Request, Tracer

# Newton is quadratic: an iteration that starts from a residual below this ends at round-off (1e-16 times the condition).
LAST_ITERATION = 1e-9
MAX_ITERATIONS = 12


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
        kept: the places of what a sample is asked for, and of the tests it has passed.
        place: slot -> its place among the kept ones.
    """

    def __init__(self, tracer: Tracer, programs: Sequence[Program]) -> None:
        self.mechanism, self.request, self.selection, self.frame = (
            tracer.mechanism,
            tracer.request,
            tracer.selection,
            tracer.frame,
        )
        self.programs: Mapping[str, Program] = {program.name: program for program in programs}
        for name in ("iterations", "done"):
            tracer.layout.scalar(name)
        self.slots, self.vectors = tracer.layout.slots, tracer.layout.vectors
        self._at_design = tracer.formulation.design
        self.state = np.array([slot for name in self._at_design for slot in self.vectors[name]])
        self.predicted = np.array([slot for name in self._at_design for slot in self.vectors[f"predicted {name}"]])
        wanted = set(self.programs["outputs"].outputs) | {self.slots["pivot"]}
        self.kept = np.array(sorted(wanted))
        self.place = {slot: k for k, slot in enumerate(self.kept.tolist())}
        after = ["motion", "outputs"] if self.request.order else ["outputs"]
        self._plan = Plan(self.programs, self.slots, after, LAST_ITERATION, MAX_ITERATIONS)
        compiled = self.request.compiled and available()
        self._code = LlvmCode(self._plan) if compiled else None
        self._executors: dict[int, Executor] = {}
        self._design = self._solve_design()

    @property
    def sizes(self) -> dict[str, dict[str, int]]:
        """Operations and flops per lane of each program."""
        return {name: {"operations": len(each.nodes), "flops": each.flops} for name, each in self.programs.items()}

    def executor(self, lanes: int) -> Executor:
        """The programs bound to a block of that many lanes; kept, because binding costs as much as running."""
        if lanes not in self._executors:
            self._executors[lanes] = LlvmExecutor(self._code, lanes) if self._code else NumpyExecutor(self._plan, lanes)
        return self._executors[lanes]

    def drive(self, block: Array, drive: Array) -> None:
        """Set the moving drivers in the lanes of a block, shape (slots, lanes).

        Args:
            drive: value from the design, velocity and acceleration of every moving driver [SI], shape (3, drivers, lanes).
        """
        for k, name in enumerate(self.request.drivers):
            places, angle = self.vectors[f"drive {name}"], self.mechanism.driver(name).type == "joint_angle"
            block[places[:3]] = drive[:, k] * (1.0 if angle else 1.0 / self.frame.unit)
            block[places[3]], block[places[4]] = np.cos(0.5 * drive[0, k]), np.sin(0.5 * drive[0, k])

    def design(self, drive: Array) -> Array:
        """The lane of the design position, moving as the drive says, shape (slots,); drive as for `drive`, one lane."""
        return self.moving(self._design, drive)

    def moving(self, lane: Array, drive: Array) -> Array:
        """A solved lane with the rates that the drive gives it there, shape (slots,)."""
        executor = self.executor(1)
        executor.block[:, 0] = lane
        self.drive(executor.block, drive)
        executor.run("tangent")
        return executor.block[:, 0].copy()

    def _solve_design(self) -> Array:
        """The pose with all drivers at their design value; normally the design itself."""
        executor = self.executor(1)
        block = executor.block
        for name, value in self._at_design.items():
            block[self.vectors[name], 0] = value
        self.drive(block, np.zeros((3, len(self.request.drivers), 1)))
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
        return block[:, 0].copy()
