"""A table of hardpoints as the input of one program: edits have answers at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from types import MappingProxyType
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ...case.case import PER_TRAVEL, Case, without_forces
from ...case.quantity import Output, Quantity
from ...doors import offers
from ...errors import KincheckError, unknown
from ...harness.labels import output_label
from ...harness.provenance import case_facts
from ...harness.scene import scene
from ...kinematics import places, require_driven
from ...program.executor import compiled_at_once
from ...report.axis import DISPLAY, Axis, driver_axis
from ...report.drawing import drawing
from ...trajectory import Array
from ...unit_text import unit_text
from ..designs.outputs import DesignOutputs, equation_of
from ..hardpoints.options import WheelOptions
from ..hardpoints.read import case_of_hardpoints
from ..hardpoints.reader import read_hardpoints
from ..hardpoints.saving import free_name, save_table
from ..hardpoints.table import Hardpoint, axes_of, number, unit_of
from ..sweep.conformance import histogram
from ..sweep.variation_file import read_variation
from ..sweep.varied_places import Geometry
from .protocol import (
    Answer,
    Bins,
    Effect,
    Invalid,
    LiveAxis,
    LiveOutput,
    LivePoint,
    LiveReference,
    Opening,
    Proposal,
    Propose,
    Rank,
    Ranking,
    Read,
    Rows,
    Save,
    Saved,
    Solve,
    Spread,
    Vary,
)

FRAMES = 41
"""Most drawn samples: as many as a hand can tell apart on the slider."""
VARIANTS = 512
"""Variants of a histogram: its bins hold some tens of them."""


class LiveFile:
    """An open file.

    Attributes:
        page: that shows it.
        axis: of the sweep, as in reports.
    """

    page = "live"
    kind: str
    file: Path
    case: Case
    axis: Axis

    def opening_of(self, engines: Sequence[str], **own: Any) -> Opening:
        """Return the opening, with the facts of this kind of file."""
        own = {"unit": self.case.length_unit, **own}
        return Opening(
            kind=self.kind,
            file=self.file.name,
            source=self.case.source,
            outputs=live_outputs(self.case),
            axis=LiveAxis(self.axis.label, self.axis.values, self.axis.scale, self.axis.up),
            engines=[*engines],
            reference=_live_reference(self.case),
            **own,
        )


class LiveTable(LiveFile):
    """A table of hardpoints, opened.

    Args:
        file: the table.
        supplied: facts missing in it.
        referenced: returns the case with what it is compared with.
        vary: file of tolerances of the case; None without one.

    Raises:
        KincheckError: the file is no table of a suspension.
    """

    kind = "table"

    def __init__(
        self,
        file: Path,
        supplied: WheelOptions,
        referenced: Callable[[Case], Case] = lambda case: case,
        vary: Path | None = None,
    ) -> None:
        self.file, self.supplied = file, supplied
        self.referenced, self.vary_file = referenced, vary
        self.table = read_hardpoints(file, supplied)
        self.names = [*self.table.points]
        self.case = referenced(case_of_hardpoints(self.table, supplied))
        require_driven(self.case.mechanism)
        self.axis = sweep_axis(self.case)
        self.variation = read_variation(vary, self.case) if vary else None
        self._ready = self._prepare(self.case)

    @property
    def positions(self) -> Rows:
        """The points as in the file."""
        return [each.position for each in self.table.points.values()]

    def opening(self, engines: Sequence[str]) -> Opening:
        """Return the table as it is."""
        roles = {each.name: each.roles for each in self.case.hardpoints}
        directions = ("forward", "left", "up"), ("rearward", "right", "down")
        axes = axes_of(self.table, self.supplied.axes)
        limits = self.variation.limits if self.variation else ()
        return self.opening_of(
            engines,
            unit=unit_of(self.table, self.supplied.units).name,
            axes=",".join(directions[sign < 0][k] for k, sign in axes),
            points=[
                LivePoint(name, each.position, roles.get(name, ()))
                for name, each in self.table.points.items()
            ],
            save=free_name(self.file),
            limits={each.output: (each.low, each.high) for each in limits},
            varied=self.variation is not None,
            tunable=bool(offers("proposals")),
        )

    def edited_case(self, points: Rows, *, followed: bool = True) -> Case:
        """Return the case of the table with other numbers, by the reader's own rules.

        Args:
            followed: whether the moves by each row are found anew; they are the same for all
                numbers, and take half of the time.

        Raises:
            KincheckError: there are more or fewer points, or the reader refuses them.
        """
        if len(points) != len(self.names):
            raise KincheckError(f"points: found {len(points)}, expected {len(self.names)}")
        moved = {
            name: Hardpoint(row, self.table.points[name].where)
            for name, row in zip(self.names, points, strict=True)
        }
        table = replace(self.table, points=moved)
        case = case_of_hardpoints(table, self.supplied, followed=followed)
        if not followed:
            case = replace(case, hardpoints=self.case.hardpoints)
        # those of the reference, if they were asked for
        return replace(case, sweep=replace(case.sweep, values=self.case.sweep.values))

    def solve(self, asked: Solve) -> Answer:
        """Return the motion of an edited table; if it is not to be whole, only up to a step that
        fails.

        Raises:
            KincheckError: the reader refuses the points.
        """
        times = [perf_counter()]
        case = self.edited_case(asked.points, followed=False)
        times.append(perf_counter())
        found = self._current(case).solve(geometry_of(case), alone=asked.whole)
        times.append(perf_counter())
        values = {
            each.name: found.values(each.name)[:, 0].tolist()
            for each in case.outputs
            if not each.forces
        }
        times.append(perf_counter())
        solved = found.solved[:, 0]
        frames = drawn_frames(solved, key_samples(case, found.solved))
        poses = {body.name: found.pose(body.name)[:, frames, 0].T for body in case.mechanism.moving}
        picture = drawn(case, self.axis, frames, poses, {})
        times.append(perf_counter())
        steps = zip(("read", "solve", "outputs", "drawing"), np.diff(times).tolist(), strict=True)
        return Answer(
            outputs=values,
            solved=solved.tolist(),
            drawing=picture,
            frames=frames,
            message=found.found.messages.get(0, ""),
            milliseconds={name: 1e3 * each for name, each in steps},
        )

    def read(self, asked: Read) -> Invalid:
        """Return the answer of the reader to a text typed for a coordinate.

        Raises:
            KincheckError: the text is no number.
        """
        where = self.table.points[asked.point].where if asked.point in self.names else ""
        value = number(self.file, f"{where}: {asked.point}: {asked.axis}", asked.text, ",")
        return Invalid(message=f"found {asked.text!r}, expected {value!r} without signs between")

    def rank(self, asked: Rank) -> Ranking:
        """Return the derivatives of an output by each number of the table.

        Raises:
            KincheckError: the reader refuses the points, or there is no such output.
        """
        case = self.edited_case(asked.points)
        names, geometry = [each.name for each in case.hardpoints], Geometry(case)
        moves, count = geometry.moves(geometry.variables), 3 * len(names)
        towards = np.concatenate(
            [
                moves.get(place, np.zeros((len(value), count)))
                for place, value in places(case.mechanism).items()
            ]
        )
        ready = self._ready_for(case, asked.output)
        found = ready.solve(geometry_of(case), alone=False)
        ((*_, by_number),) = found.slopes(towards)
        samples = key_samples(self.case, found.solved)
        slopes = by_number[:, samples, 0].T
        order: list[int] = np.argsort(
            -np.nan_to_num(np.abs(slopes)).max(axis=0), kind="stable"
        ).tolist()
        effects = [Effect(names[k // 3], "xyz"[k % 3], slopes[:, k].tolist()) for k in order]
        return Ranking(output=asked.output, samples=samples, effects=effects)

    def vary(self, asked: Vary) -> Spread:
        """Return histograms of an output over the variants of the file of tolerances.

        Raises:
            KincheckError: the reader or the file of tolerances refuses the points, or there is no
                such output or file.
        """
        if self.vary_file is None:
            raise KincheckError("tolerances: there is no file of them; start kincheck with --vary")
        case = self.edited_case(asked.points)
        variation = read_variation(self.vary_file, case)
        count = min(variation.count or VARIANTS, VARIANTS)
        varied = variation.geometry(variation.offsets(0, 0, count))
        geometry = geometry_of(case, _by_place(variation.places, varied))
        self._require_motion(case, asked.output)
        found = self._current(case).solve(geometry, alone=False)
        values, samples = found.values(asked.output), key_samples(case, found.solved)
        bins = [histogram([values], sample) for sample in samples]
        return Spread(
            output=asked.output,
            samples=samples,
            bins=[each and Bins(each.edges, each.counts) for each in bins],
            variants=count,
            failed=int((~found.solved.all(axis=0)).sum()),
        )

    def propose(self, asked: Propose) -> Proposal:
        """Return the points that bring outputs into bands, by an extension that offers it.

        Raises:
            KincheckError: no extension does, or it finds none.
        """
        case, offer = self.edited_case(asked.points), next(iter(offers("proposals").values()), None)
        if offer is None:
            raise KincheckError("proposals: the extension that finds them is not installed")
        moves, message = offer.load()(case, asked.bands, asked.boxes)
        size = unit_of(self.table, self.supplied.units).size
        points = list[tuple[float, float, float]]()
        for name, row in zip(self.names, asked.points, strict=True):
            x, y, z = (
                at + moves.get(f"{name} {axis}", 0.0) / size
                for at, axis in zip(row, "xyz", strict=True)
            )
            points.append((x, y, z))
        found = self.solve(Solve(points=points))
        return Proposal(
            points=points, message=message, outputs=found.outputs, drawing=found.drawing
        )

    def save(self, asked: Save) -> Saved:
        """Write the table with other numbers to a new file.

        Raises:
            KincheckError: as `save_table`, or the reader refuses the points.
        """
        self.edited_case(asked.points)
        return Saved(name=save_table(self.table, self.supplied, asked.points, asked.name).name)

    def _prepare(self, case: Case) -> DesignOutputs:
        """Return the program of a case, compiled."""
        with compiled_at_once():  # otherwise an edit in between waits for the compiler
            bodies = [body.name for body in case.mechanism.moving]
            ready = DesignOutputs.of(without_forces(case), places(case.mechanism), bodies=bodies)
            ready.solve(geometry_of(case))
        self._structure, self._differentiated = structure_of(case), dict[str, DesignOutputs]()
        return ready

    def _current(self, case: Case) -> DesignOutputs:
        """Return the program of a case: the same for all numbers, unless they change the joints."""
        if self._structure != structure_of(case):
            self._ready = self._prepare(case)
        return self._ready

    def _ready_for(self, case: Case, name: str) -> DesignOutputs:
        """Return the program of an output with its slopes.

        Raises:
            KincheckError: there is no such output of motion.
        """
        output = self._require_motion(case, name)
        self._current(case)
        if name not in self._differentiated:
            alone = replace(case, outputs=(output,))
            self._differentiated[name] = DesignOutputs.of(
                alone, places(case.mechanism), slopes={name: 1}
            )
        return self._differentiated[name]

    def _require_motion(self, case: Case, name: str) -> Quantity:
        known = {each.name: each for each in case.outputs if not each.forces}
        if name not in known:
            raise KincheckError(unknown("output", name, known))
        return known[name]


def drawn_frames(solved: NDArray[np.bool_], always: Sequence[int] = ()) -> list[int]:
    """Return some of the solved samples to draw, among them those of `always`."""
    count = len(solved)
    evenly: list[int] = np.linspace(0, count - 1, min(FRAMES, count)).round().astype(int).tolist()
    return [k for k in sorted({*evenly, *always}) if solved[k]]


def drawn(
    case: Case,
    axis: Axis,
    frames: list[int],
    poses: Mapping[str, Array],
    values: Mapping[str, Sequence[float | None]],
) -> dict[str, Any]:
    """Return the scene of reports.

    Args:
        poses: origin and Euler parameters by body, shape (frames, 7).
        values: of outputs, for the arrows of forces.
    """
    stands = scene(case, poses=False)
    bodies = [
        msgspec.structs.replace(body, r=at[:, :3].tolist(), p=at[:, 3:].tolist())
        if (at := poses.get(body.name)) is not None
        else body
        for body in stands.bodies
    ]
    posed = msgspec.structs.replace(stands, frames=frames, bodies=bodies, message="")
    return msgspec.structs.asdict(drawing(posed, axis, values))


def sweep_axis(case: Case) -> Axis:
    """Return the axis of a case's sweep, as in reports."""
    values = case.sweep.values.tolist()
    axis = driver_axis(case_facts(case), [], [])
    return replace(axis, values=values, kept=[*range(len(values))])


def key_samples(case: Case, solved: NDArray[np.bool_]) -> list[int]:
    """Return the first sample that most of V variants reach, the one nearest to design and the
    last.

    Args:
        solved: shape (n, V).
    """
    known: list[int] = np.flatnonzero(solved.mean(axis=1) > 0.5).tolist() or [0]
    return [known[0], int(np.abs(case.sweep.change).argmin()), known[-1]]


def live_outputs(case: Case) -> list[LiveOutput]:
    """Return the outputs of a case for the page."""
    return [*map(_live_output, case.outputs)]


def _live_output(output: Quantity) -> LiveOutput:
    """Return an output for the page, in display units."""
    shown, scale = DISPLAY.get(output.unit, (output.unit, 1.0))
    group = "coordinates" if isinstance(output, Output) else "outputs"
    return LiveOutput(
        name=output.name,
        label=output_label(output.name),
        unit=output.unit,
        shown_unit=unit_text(shown),
        scale=scale,
        group="per travel" if output.name.endswith(PER_TRAVEL) else group,
    )


def _live_reference(case: Case) -> dict[str, LiveReference]:
    """Return the reference of a case with the tolerances of a run."""
    found = dict[str, LiveReference]()
    for each in case.outputs:
        if each.name in case.reference:
            series = case.reference[each.name]
            known = series.position[np.isfinite(series.position)]
            extent = float(np.ptp(known)) if len(known) else 0.0
            within = float(np.max((series.uncertainty or {}).get("position", 0.0)))
            tolerance = each.atol + each.rtol * extent + within
            found[each.name] = LiveReference(series.position.tolist(), tolerance)
    return found


def _by_place(sizes: Mapping[str, int], geometry: Array) -> dict[str, Array]:
    """Return the rows of the geometry by place."""
    return dict(zip(sizes, np.split(geometry, np.cumsum([*sizes.values()])[:-1]), strict=True))


def geometry_of(case: Case, moved: Mapping[str, Array] = MappingProxyType({})) -> Array:
    """Return the numbers of all places of V variants, shape (numbers, V).

    Args:
        moved: places with other numbers, shape (numbers of the place, V).
    """
    variants = next(iter(moved.values()), np.zeros((1, 1))).shape[1]
    return np.concatenate(
        [
            moved.get(place, np.repeat(np.array(value, dtype=float)[:, None], variants, axis=1))
            for place, value in places(case.mechanism).items()
        ]
    )


def structure_of(case: Case) -> list[Any]:
    """Return the key of a program: all but the numbers of places, and tolerances."""
    joints = [f"{each.name} {each.type} {each.bodies}" for each in case.mechanism.joints]
    points = [f"{each.name} {each.body}" for each in case.mechanism.points]
    return [*joints, *points, *places(case.mechanism), *map(equation_of, case.outputs)]
