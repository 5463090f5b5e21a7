"""A table of hardpoints as the input of one program: edits have answers at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from types import MappingProxyType
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ...algebra import Vec3
from ...case.case import HELD_BUT, PER_TRAVEL, Case, size, without_forces
from ...case.closing import held_case, moves_alone
from ...case.io.reader_options import Supplied
from ...case.models.files import read_hardpoints
from ...case.quantity import Output, Quantity, still_jets
from ...case.turns import count_output_turns
from ...errors import KincheckError, unknown
from ...harness.labels import output_label
from ...harness.provenance import case_facts
from ...harness.scene import scene
from ...harness.trajectory_check import SAME_POSE
from ...jet import Jet
from ...kinematics import NativeSolver, PreparedDesigns, Variants, places, require_driven
from ...mechanism.motions import Path as Way
from ...program.llvm.machine_code import available
from ...report.axis import DISPLAY, Axis, driver_axis
from ...report.drawing import drawing
from ...trajectory import Array
from ...unit_text import unit_text
from ..hardpoints.read import case_of_hardpoints
from ..hardpoints.saving import free_name, save_table
from ..hardpoints.table import Hardpoint, axes_of, number, unit_of
from ..sweep.conformance import histogram
from ..sweep.variation_file import read_variation
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

TOL = 1e-12
"""Largest accepted residual, relative to the mechanism's size, as in `kincheck run`."""
FRAMES = 41
"""Most drawn samples: as many as a hand can tell apart on the slider."""
VARIANTS = 512
"""Variants of a histogram: its bins hold some tens of them."""
PARTS = 16
"""Parts of a step on a path with velocities by some drivers alone: of eight, some fail."""
MOVED = 2e-5
"""Half of the difference for derivatives [m]: its square times a third derivative is far below the
three digits shown, and rounding of 1e-15 m over it too."""


class LiveFile:
    """A file that is open.

    Attributes:
        axis: of the sweep, as in reports.
    """

    kind: str
    file: Path
    case: Case
    axis: Axis

    def opening_of(self, engines: Sequence[str], **own: Any) -> Opening:
        """Return what the openings of all files tell, and what this one does."""
        own = {"unit": self.case.length_unit, **own}
        return Opening(
            kind=self.kind,
            file=self.file.name,
            source=self.case.source,
            outputs=[*map(_live_output, self.case.outputs)],
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
        supplied: Supplied,
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
        self._structure, self._designs = self._prepare(self.case)

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
        )

    def edited_case(self, points: Rows) -> Case:
        """Return the case of the table with other numbers, by the reader's own rules.

        Raises:
            KincheckError: there are more or fewer points, or the reader refuses them.
        """
        if len(points) != len(self.names):
            raise KincheckError(f"points: found {len(points)}, expected {len(self.names)}")
        moved = {
            name: Hardpoint(row, self.table.points[name].where)
            for name, row in zip(self.names, points, strict=True)
        }
        case = case_of_hardpoints(replace(self.table, points=moved), self.supplied)
        # those of the reference, if they were asked for
        return replace(case, sweep=replace(case.sweep, values=self.case.sweep.values))

    def solve(self, asked: Solve) -> Answer:
        """Return the motion of an edited table; if it is not to be whole, without the outputs that
        need another solution, and only up to a step that fails.

        Raises:
            KincheckError: the reader refuses the points.
        """
        times = [perf_counter()]
        case = self.edited_case(asked.points)
        times.append(perf_counter())
        designs, geometry = self._current_designs(case), _geometry(case)
        found = designs.solve(geometry, TOL, alone=asked.whole)
        times.append(perf_counter())
        outputs = [each for each in case.outputs if asked.whole or _alone(each) not in self._held]
        values = {
            name: each[:, 0].tolist()
            for name, each in self._outputs(case, designs, found, geometry, outputs).items()
        }
        times.append(perf_counter())
        solved = found.solved[:, 0]
        frames = drawn_frames(solved, key_samples(case, found.solved))
        poses = {
            body.name: designs.pose(found, body.name)[:, frames, 0].T
            for body in case.mechanism.moving
        }
        picture = drawn(case, self.axis, frames, poses, {})
        times.append(perf_counter())
        steps = zip(("read", "solve", "outputs", "drawing"), np.diff(times).tolist(), strict=True)
        return Answer(
            outputs=values,
            solved=solved.tolist(),
            drawing=picture,
            frames=frames,
            message=found.messages.get(0, ""),
            milliseconds={name: 1e3 * each for name, each in steps},
        )

    def read(self, asked: Read) -> Invalid:
        """Return what the reader says to a text typed for a coordinate.

        Raises:
            KincheckError: the text is no number.
        """
        where = self.table.points[asked.point].where if asked.point in self.names else ""
        value = number(self.file, f"{where}: {asked.point}: {asked.axis}", asked.text, ",")
        return Invalid(message=f"found {asked.text!r}, expected {value!r} without signs between")

    def rank(self, asked: Rank) -> Ranking:
        """Return the derivatives of an output by each number of the table, by differences.

        Raises:
            KincheckError: the reader refuses the points, or there is no such output.
        """
        case = self.edited_case(asked.points)
        names = [each.name for each in case.hardpoints]
        steps = np.kron(np.eye(3 * len(names)), [[MOVED], [-MOVED]])
        offsets = dict(zip(names, np.split(steps, len(names), axis=1), strict=True))
        moved = {
            name: each.reshape(len(steps), -1).T for name, each in case.geometry(offsets).items()
        }
        found, values = self._of_variants(case, asked.output, _geometry(case, moved))
        samples = key_samples(self.case, found.solved)
        slopes = ((values[:, ::2] - values[:, 1::2]) / (2 * MOVED))[samples]
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
        geometry = _geometry(case, _by_place(variation.places, varied))
        found, values = self._of_variants(case, asked.output, geometry)
        samples = key_samples(case, found.solved)
        bins = [histogram([values], sample) for sample in samples]
        return Spread(
            output=asked.output,
            samples=samples,
            bins=[each and Bins(each.edges, each.counts) for each in bins],
            variants=count,
            failed=int((~found.solved.all(axis=0)).sum()),
        )

    def save(self, asked: Save) -> Saved:
        """Write the table with other numbers to a new file.

        Raises:
            KincheckError: as `save_table`, or the reader refuses the points.
        """
        self.edited_case(asked.points)
        return Saved(name=save_table(self.table, self.supplied, asked.points, asked.name).name)

    def _prepare(self, case: Case) -> tuple[list[str], PreparedDesigns]:
        """Return the key of a program, and the program, compiled."""
        path = case.sweep.path
        bodies = [body.name for body in case.mechanism.moving]

        def prepare(path: Way) -> PreparedDesigns:
            wanted = [*places(case.mechanism)], without_forces(case).points
            designs = NativeSolver().prepare_designs(case.mechanism, path, *wanted, bodies=bodies)
            designs.solve(_geometry(case), TOL)
            return designs

        at_once: AbstractContextManager[None] = nullcontext()
        if available():
            from ...program.llvm.jit import compiled_at_once

            at_once = compiled_at_once()
        with at_once:  # otherwise an edit in between waits for the compiler
            designs = prepare(path)
            self._held = {
                alone: prepare(_in_parts(held_case(case, alone).sweep.path))
                for alone in dict.fromkeys(map(_alone, case.outputs))
                if alone and not moves_alone(path, alone)
            }
        return _structure(case), designs

    def _current_designs(self, case: Case) -> PreparedDesigns:
        """Return the program of a case: the same for all numbers, unless they change the joints."""
        if self._structure != _structure(case):
            self._structure, self._designs = self._prepare(case)
        return self._designs

    def _of_variants(self, case: Case, name: str, geometry: Array) -> tuple[Variants, Array]:
        """Return V variants, and the values of an output over their samples, shape (n, V).

        Raises:
            KincheckError: there is no such output of motion.
        """
        known = {each.name: each for each in case.outputs if not each.forces}
        if name not in known:
            raise KincheckError(unknown("output", name, known))
        designs = self._current_designs(case)
        found = designs.solve(geometry, TOL, alone=False)
        return found, self._outputs(case, designs, found, geometry, [known[name]])[name]

    def _outputs(
        self,
        case: Case,
        designs: PreparedDesigns,
        found: Variants,
        geometry: Array,
        outputs: Sequence[Quantity],
    ) -> dict[str, Array]:
        """Return outputs over the samples of V variants, shape (n, V)."""
        names, values = without_forces(case).points, dict[str, Array]()
        sizes = {place: len(value) for place, value in places(case.mechanism).items()}
        standing = _by_place(sizes, geometry)
        design = {
            name: still_jets(standing[place])
            for name in names
            if (place := f"points.{name}.position") in standing
        }
        computed = [(each, _alone(each)) for each in outputs if not each.forces]
        with np.errstate(all="ignore"):
            for alone in dict.fromkeys(by for _, by in computed):
                # the same poses, with velocities by some drivers while the others rest
                held, known = found, found.solved
                if alone in self._held:
                    fine = self._held[alone].solve(geometry, TOL)
                    held = replace(fine, kept=fine.kept[:, ::PARTS], solved=fine.solved[::PARTS])
                    off = [
                        np.abs(designs.motion(found, name)[0] - designs.motion(held, name)[0])
                        for name in names
                    ]
                    # at one place: not in another assembly
                    known = held.solved & (np.max(off, axis=(0, 1)) <= SAME_POSE * size(case))
                at = {
                    name: Vec3(*(Jet(*each) for each in zip(*motion, strict=True)))
                    for name in names
                    for motion in [designs.motion(held, name)]
                }
                for each in (each for each, by in computed if by == alone):
                    moved = {name: at[name] for name in each.points}
                    jet = count_output_turns(case.mechanism, case.sweep.path, each, moved, design)
                    values[each.name] = np.where(known, jet.x, np.nan)
        return values


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


def _alone(output: Quantity) -> tuple[str, ...]:
    """Return the drivers by which an output is differentiated while the others rest."""
    return tuple(output.facts.get(HELD_BUT, ()))


def _in_parts(path: Way) -> Way:
    """Return a path with its steps in equal parts, which are followed whole: the velocities at its
    samples do not point to the next ones.
    """
    samples = np.arange(len(path.times))
    parts = np.arange(PARTS * (len(samples) - 1) + 1) / PARTS
    return replace(path, times=np.interp(parts, samples, path.times))


def _by_place(sizes: Mapping[str, int], geometry: Array) -> dict[str, Array]:
    """Return the rows of the geometry by place."""
    return dict(zip(sizes, np.split(geometry, np.cumsum([*sizes.values()])[:-1]), strict=True))


def _geometry(case: Case, moved: Mapping[str, Array] = MappingProxyType({})) -> Array:
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


def _structure(case: Case) -> list[str]:
    """Return the key of a program: all but the numbers."""
    joints = [f"{each.name} {each.type} {each.bodies}" for each in case.mechanism.joints]
    points = [f"{each.name} {each.body}" for each in case.mechanism.points]
    return [*joints, *points, *places(case.mechanism), *(each.name for each in case.outputs)]
