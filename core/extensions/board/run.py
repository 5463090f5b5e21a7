"""Runs of the board: each row is the folder of its own reproducer, run in a process of its own."""

from __future__ import annotations

import json
import math
import os
import subprocess
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ...case.io.escape import file_name
from ...doors import offers
from ...errors import KincheckError, UnsupportedError, unknown
from ...extras import THREADS, how_to_install
from ...harness.record import to_json
from ..environments.environments import how_to_add, python_of
from ..free.section import free_in
from .results import Row, Run, State
from .truth import Truth

SETTINGS = Path(__file__).with_name("settings.toml")
HALVINGS = 3
# A halved step that lowers the error by less than this part of a digit of order has met a floor.
FLOOR = 0.5
# Errors within a hundredth of each other are alike: solvers end at their own tolerances.
ALIKE = 0.99
# What a stepper and its rows have in common.
SHARED = ("engine", "integrator", "group", "loop", "ties", "precision")

Files = Callable[[str, Truth], Mapping[str, str]]
"""Function from engine and truth to the files of a reproducer: model.json and run.py."""


@dataclass(frozen=True)
class Stepper:
    """A stepper of the board; see settings.toml.

    Attributes:
        accuracies: efforts of an engine that controls its steps; empty for fixed steps.
        samples: number of compared ones; None for all.
        best: settings; None if no better ones than the defaults are known.
    """

    engine: str
    integrator: str
    group: str
    loop: str
    ties: str
    order: int | None = None
    accuracies: Sequence[float] = ()
    precision: str = "float64"
    samples: int | None = None
    best: Mapping[str, Any] | None = None
    by: str = ""
    date: Any = ""

    @property
    def columns(self) -> dict[str, Mapping[str, Any]]:
        """The settings by column."""
        return {"default": {}, **({} if self.best is None else {"best": self.best})}

    def efforts(self, truth: Truth, steps: int) -> list[dict[str, Any]]:
        """Return the efforts on a case: at least so many steps, halved three times."""
        if self.accuracies:
            return [{"accuracy": each} for each in self.accuracies]
        gap = float(truth.times[-1]) / (len(truth.times) - 1)
        asked = free_in(truth.case)
        assert asked is not None
        first = math.ceil(steps / (asked.samples - 1))
        return [{"step": gap / n, "steps": n} for n in (first << k for k in range(HALVINGS + 1))]


def steppers(engines: Sequence[str] = ()) -> list[Stepper]:
    """Return the steppers, by default those of all engines.

    Raises:
        KincheckError: no stepper is of an engine.
    """
    table = tomllib.loads(SETTINGS.read_text("utf-8"))["stepper"]
    every = [Stepper(**each) for each in table]
    names = [*dict.fromkeys(each.engine for each in every)]
    if problems := [unknown("engine", name, names) for name in engines if name not in names]:
        raise KincheckError("\n".join(f"--engine: {problem}" for problem in problems))
    return [each for each in every if not engines or each.engine in engines]


def rows_of(
    truth: Truth,
    wanted: Sequence[Stepper],
    files: Files,
    earlier: Mapping[str, Row],
    *,
    out: Path,
    steps: int,
    timeout: float,
) -> Iterator[Row]:
    """Yield the rows of a case; write the reproducer of each below a folder, and run it.

    Args:
        earlier: rows of an earlier board in this folder, by their keys.
        steps: least number of the longest steps in the whole motion.
        timeout: of all runs of a row [s].
    """
    for stepper in wanted:
        default: Row | None = None
        for column, settings in stepper.columns.items():
            row = Row(
                case=truth.case.name,
                **{name: getattr(stepper, name) for name in SHARED},
                design_order=stepper.order,
                column=column,
                settings=dict(settings),
                by=stepper.by if settings else "",
                on=str(stepper.date) if settings else "",
                state="unsupported",
            )
            try:
                texts = files(stepper.engine, truth)
            except UnsupportedError as error:
                yield msgspec.structs.replace(row, message=str(error)).with_history(earlier)
                continue
            name = f"{stepper.engine}-{stepper.integrator}-{column}"
            folder = Path(file_name(truth.case.name)) / file_name(name)
            given = {
                **settings,
                "integrator": stepper.integrator,
                "efforts": stepper.efforts(truth, steps),
            }
            points = json.loads(texts["model.json"])["points"]
            texts = {
                **texts,
                "settings.json": json.dumps(given, indent=1) + "\n",
                **truth.tables(points, stepper.samples or len(truth.times)),
            }
            _write(out / folder, texts)
            row = msgspec.structs.replace(row, folder=str(folder))
            done = measured(row, out / folder, timeout)
            default = default or done
            if stepper.samples and done.measured:
                end = truth.times[: stepper.samples][-1]
                done = msgspec.structs.replace(done, message=f"the first {end:.3g} s alone")
            done = better(default, done).with_history(earlier)
            _write(out / folder, {"row.json": to_json(done).decode()})
            yield done


def better(default: Row, best: Row) -> Row:
    """Return the row of the best known settings, or the default's if its error is smaller."""
    if not default.error or not best.error or default.error >= ALIKE * best.error:
        return best
    message = f"the defaults are nearer: other settings have an error of {best.error:.3g} m"
    return msgspec.structs.replace(default, column="best", message=message)


def _write(folder: Path, texts: Mapping[str, str]) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            (folder / name).write_text(text, "utf-8")
    except OSError as error:
        raise KincheckError(
            f"--out: {folder} cannot be written ({error.strerror}); give another folder"
        ) from None


def measured(row: Row, place: Path, timeout: float) -> Row:
    """Run the reproducer in a folder, and return the row with its runs."""
    state: State | None = None
    message, result = "", place / "result.json"
    result.unlink(missing_ok=True)
    environment = {**os.environ, **dict.fromkeys(THREADS, "1")}
    try:
        done = subprocess.run(
            [python_of(row.engine), "-P", "run.py"],
            cwd=place,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=timeout,
            check=False,
        )
        if done.returncode:
            last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
            state = "crashed"
            message = f"its process ended with status {done.returncode}; {' '.join(last)[:300]}"
    except subprocess.TimeoutExpired:
        state, message = "timeout", f"its runs take more than {timeout:g} s together"
    found = dict[str, Any]()
    if result.is_file():
        found = json.loads(result.read_text("utf-8"))
    runs = [msgspec.convert(each, Run) for each in found.get("runs", ())]
    order, floor = order_and_floor(runs)
    if state is None and (said := found.get("message", "")):
        kind, _, message = said.partition(": ")
        state = "unavailable" if kind == "unavailable" else "unsupported"
        if state == "unavailable":
            wanted = offers("steppers")[row.engine].load().apart
            remedy = how_to_add(row.engine, wanted) if wanted else how_to_install(row.engine)
            message = f"{message}; {remedy}"
    if state is None:
        state, message = _state(runs)
    return msgspec.structs.replace(
        row,
        version=found.get("version", ""),
        state=state,
        message=message,
        runs=runs,
        order=order,
        floor=floor,
    )


def _state(runs: Sequence[Run]) -> tuple[State, str]:
    message = "; ".join(dict.fromkeys(run.message for run in runs if run.message))
    if any(run.error is not None for run in runs):
        return "measured", message
    finite = any(not run.message.startswith("not finite") for run in runs)
    return "failed" if finite else "diverged", message


def order_and_floor(runs: Sequence[Run]) -> tuple[float | None, float | None]:
    """Return the order of convergence by least squares over the runs above the floor, and the floor
    [m]: the smallest error, if halving the step no longer lowers it.
    """
    pairs = [(run.step, run.error) for run in runs if run.step and run.error]
    if len(pairs) < 2 or len(pairs) < len(runs):
        return None, None
    steps, errors = np.log2(np.array(pairs)).T
    falling = [bool(each) for each in np.diff(errors) / np.diff(steps) >= FLOOR]
    floor = None if falling[-1] else min(error for _, error in pairs)
    if True not in falling:
        return None, floor
    # the last steps that lower the error, one after the other
    last = len(falling) - falling[::-1].index(True)
    first = last - [*falling[:last][::-1], False].index(False)
    x, y = steps[first : last + 1], errors[first : last + 1]
    shift = x - x.mean()
    return float(shift @ y / (shift @ shift)), floor
