"""A table of hardpoints as the input of one program: edits have answers at once."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import msgspec
import numpy as np

from ..algebra import Vec3
from ..case.case import HELD_BUT, PER_TRAVEL, Case, without_forces
from ..case.io.reader_options import Supplied
from ..case.models.files import read_hardpoints
from ..case.models.hardpoints.read import case_of_hardpoints
from ..case.models.hardpoints.table import Hardpoint, axes_of, unit_of
from ..case.quantity import Output, Quantity
from ..case.turns import counted
from ..errors import KincheckError, unknown
from ..harness.labels import output_label
from ..harness.scene import scene
from ..jet import Jet
from ..kinematics import NativeSolver, PreparedDesigns, Variants, places, require_driven
from ..program.llvm.compiler import available
from ..report.axis import DISPLAY, Axis, driver_axis
from ..report.drawing import drawing
from ..trajectory import Array
from ..unit_text import unit_text
from .protocol import (
    VERSION,
    Answer,
    Effect,
    LiveAxis,
    LiveOutput,
    LivePoint,
    Opening,
    Ranking,
    Refused,
    Rows,
    Values,
)
from .saving import free_name, save_table

TOL = 1e-12
"""Largest accepted residual, relative to the mechanism's size, as in `kincheck run`."""
FRAMES = 41
"""Most drawn samples: as many as a hand can tell apart on the slider."""
MOVED = 2e-5
"""Half of the difference for derivatives [m]: its square times a third derivative is far below the
three digits shown, and rounding of 1e-15 m over it too."""


class LiveTable:
    """A table of hardpoints, opened.

    Args:
        file: the table.
        supplied: facts missing in it.

    Raises:
        KincheckError: the file is no table of a suspension.
    """

    kind = "table"

    def __init__(self, file: Path, supplied: Supplied) -> None:
        self.file, self.supplied = file, supplied
        self.table = read_hardpoints(file, supplied)
        self.names = [*self.table.points]
        self.case = case_of_hardpoints(self.table, supplied)
        require_driven(self.case.mechanism)
        self.axis = sweep_axis(self.case)
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
        return Opening(
            protocol=VERSION,
            kind=self.kind,
            file=self.file.name,
            source=self.case.source,
            unit=unit_of(self.table, self.supplied.units).name,
            axes=",".join(directions[sign < 0][k] for k, sign in axes),
            points=[
                LivePoint(name, each.position, roles.get(name, ()))
                for name, each in self.table.points.items()
            ],
            outputs=live_outputs(self.case),
            axis=live_axis(self.axis),
            drivers=[],
            engines=[*engines],
            save=free_name(self.file),
        )

    def edited(self, points: Rows) -> Case:
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
        return case_of_hardpoints(replace(self.table, points=moved), self.supplied)

    def answer(self, number: int, points: Rows) -> Answer | Refused:
        """Return the motion of an edited table, or why there is none."""
        begin = perf_counter()
        try:
            case = self.edited(points)
        except KincheckError as error:
            return self.refusal(number, error)
        read = perf_counter()
        designs, geometry = self._prepared(case), _numbers(case)
        found = designs.solve(geometry, TOL)
        solved = perf_counter()
        values = {
            name: as_values(each[:, 0])
            for name, each in self._outputs(case, designs, found, geometry, case.outputs).items()
        }
        evaluated = perf_counter()
        drawn, frames = self._drawing(case, designs, found)
        steps = {
            "read": read - begin,
            "solve": solved - read,
            "outputs": evaluated - solved,
            "drawing": perf_counter() - evaluated,
        }
        return Answer(
            id=number,
            outputs=values,
            solved=found.solved[:, 0].tolist(),
            drawing=drawn,
            frames=frames,
            message=found.messages.get(0, ""),
            milliseconds={name: 1e3 * each for name, each in steps.items()},
        )

    def refusal(self, number: int, error: KincheckError) -> Refused:
        """Return a message of the reader, with the row of the table in its text."""
        text = str(error).removeprefix(f"{self.file}: ")
        named = (each for each in self.names if re.search(rf"\b{re.escape(each)}\b", text))
        return Refused(id=number, message=text, point=next(named, ""))

    def ranking(self, number: int, points: Rows, output: str) -> Ranking:
        """Return the derivatives of an output by each number of the table, by differences.

        Raises:
            KincheckError: the reader refuses the points, or there is no such output.
        """
        case = self.edited(points)
        known = {each.name: each for each in _computed(case)}
        if output not in known:
            raise KincheckError(unknown("output", output, known))
        names = [each.name for each in case.hardpoints]
        designs, steps = self._prepared(case), np.repeat(np.eye(3), 2, axis=0) * MOVED
        steps[1::2] *= -1.0
        count = 6 * len(names)
        offsets = {name: np.zeros((count, 3)) for name in names}
        for k, name in enumerate(names):
            offsets[name][6 * k : 6 * k + 6] = steps
        moved = case.geometry(offsets)
        geometry = np.concatenate(
            [
                np.reshape(moved[place], (count, -1)).T
                if place in moved
                else np.repeat(np.array(value, dtype=float)[:, None], count, axis=1)
                for place, value in places(case.mechanism).items()
            ]
        )
        found = designs.solve(geometry, TOL)
        values = self._outputs(case, designs, found, geometry, [known[output]])[output]
        samples = key_samples(self.case)
        slopes = ((values[:, ::2] - values[:, 1::2]) / (2 * MOVED))[samples]
        order: list[int] = np.argsort(
            -np.nan_to_num(np.abs(slopes)).max(axis=0), kind="stable"
        ).tolist()
        effects = [Effect(names[k // 3], "xyz"[k % 3], as_values(slopes[:, k])) for k in order]
        return Ranking(id=number, output=output, samples=samples, effects=effects)

    def save(self, points: Rows, name: str) -> str:
        """Write the table with other numbers to a new file; return its name.

        Raises:
            KincheckError: as `save_table`, or the reader refuses the points.
        """
        self.edited(points)
        return save_table(self.table, self.supplied, points, name).name

    def _prepare(self, case: Case) -> tuple[list[str], PreparedDesigns]:
        """Return the key of a program, and the program, compiled."""
        bodies = [body.name for body in case.mechanism.moving]
        with _at_once():  # otherwise an edit in between waits for the compiler
            designs = NativeSolver().prepare_designs(
                case.mechanism,
                case.sweep.path,
                [*places(case.mechanism)],
                without_forces(case).points,
                bodies=bodies,
            )
            designs.solve(_numbers(case), TOL)
        return _structure(case), designs

    def _prepared(self, case: Case) -> PreparedDesigns:
        """Return the program of a case: the same for all numbers, unless they change the joints."""
        if self._structure != _structure(case):
            self._structure, self._designs = self._prepare(case)
        return self._designs

    def _outputs(
        self,
        case: Case,
        designs: PreparedDesigns,
        found: Variants,
        geometry: Array,
        outputs: Sequence[Quantity],
    ) -> dict[str, Array]:
        """Return outputs over the samples of V variants, shape (n, V)."""
        first, rows = 0, dict[str, slice]()
        for place, value in places(case.mechanism).items():
            rows[place] = slice(first, first + len(value))
            first += len(value)
        at, design = dict[str, Vec3](), dict[str, Vec3]()
        for name in without_forces(case).points:
            motion = designs.motion(found, name)
            at[name] = Vec3(*(Jet(*each) for each in zip(*motion, strict=True)))
            stands = geometry[rows[f"points.{name}.position"]]
            design[name] = Vec3(*(Jet(a, np.zeros(()), np.zeros(())) for a in stands))
        with np.errstate(all="ignore"):
            return {
                each.name: np.broadcast_to(
                    counted(
                        case.mechanism,
                        case.sweep.path,
                        each,
                        {name: at[name] for name in each.points},
                        design,
                    ).x,
                    found.solved.shape,
                )
                for each in _computed(case)
                if each in outputs
            }

    def _drawing(
        self, case: Case, designs: PreparedDesigns, found: Variants
    ) -> tuple[dict[str, Any], list[int]]:
        """Return the scene of reports at some of the solved samples, and these samples."""
        count = len(found.solved)
        taken = {*np.linspace(0, count - 1, min(FRAMES, count)).round().astype(int).tolist()}
        taken |= {*key_samples(case)}
        frames = [k for k in sorted(taken) if found.solved[k, 0]]
        poses = {
            body.name: designs.pose(found, body.name)[:, frames, 0].T
            for body in case.mechanism.moving
        }
        stands = scene(case, poses=False)
        bodies = [
            body
            if body.name not in poses
            else msgspec.structs.replace(
                body, r=poses[body.name][:, :3].tolist(), p=poses[body.name][:, 3:].tolist()
            )
            for body in stands.bodies
        ]
        posed = msgspec.structs.replace(stands, frames=frames, bodies=bodies, message="")
        return asdict(drawing(posed, self.axis)), frames


def sweep_axis(case: Case) -> Axis:
    """Return the axis of a case's sweep, as in reports."""
    sweep, known = case.sweep, {each.name: each for each in case.mechanism.drivers}
    driver = known.get(sweep.driver)
    facts = {"name": sweep.driver, "type": sweep.driver} if driver is None else asdict(driver)
    facts |= {} if driver is None else {"type": driver.type}
    axis = driver_axis({"driver": facts}, [], [])
    values = sweep.values.tolist()
    return replace(axis, values=values, kept=[*range(len(values))])


def live_axis(axis: Axis) -> LiveAxis:
    """Return the axis for the page."""
    return LiveAxis(axis.label, axis.values, axis.scale, axis.up)


def live_outputs(case: Case) -> list[LiveOutput]:
    """Return the outputs of a case for the page, in display units."""
    found = list[LiveOutput]()
    for each in case.outputs:
        shown, scale = DISPLAY.get(each.unit, (each.unit, 1.0))
        group = "coordinates" if isinstance(each, Output) else "outputs"
        group = "per travel" if each.name.endswith(PER_TRAVEL) else group
        label = output_label(each.name)
        found.append(LiveOutput(each.name, label, each.unit, unit_text(shown), scale, group))
    return found


def key_samples(case: Case) -> list[int]:
    """Return the first sample, the one nearest to design and the last."""
    return [0, int(np.abs(case.sweep.change).argmin()), len(case.sweep.values) - 1]


def as_values(values: Array) -> Values:
    """Return numbers for JSON: null for unknown ones."""
    return [
        each if known else None
        for each, known in zip(values.tolist(), np.isfinite(values).tolist(), strict=True)
    ]


def _computed(case: Case) -> list[Quantity]:
    """Return the outputs of motion from one solution; see `HELD_BUT` for the others."""
    return [each for each in case.outputs if not each.forces and HELD_BUT not in each.facts]


def _at_once() -> AbstractContextManager[None]:
    if not available():
        return nullcontext()
    from ..program.llvm.jit import compiled_at_once

    return compiled_at_once()


def _numbers(case: Case) -> Array:
    """Return the numbers of all places of the geometry, shape (numbers, 1)."""
    return np.concatenate([np.array(v, dtype=float) for v in places(case.mechanism).values()])[
        :, None
    ]


def _structure(case: Case) -> list[str]:
    """Return the key of a program: all but the numbers."""
    joints = [f"{each.name} {each.type} {each.bodies}" for each in case.mechanism.joints]
    points = [f"{each.name} {each.body}" for each in case.mechanism.points]
    return [*joints, *points, *places(case.mechanism), *(each.name for each in case.outputs)]
