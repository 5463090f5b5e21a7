"""A functional mock-up unit (FMI 2 and 3) as an engine: drivers set its inputs at the samples, and
outputs are read at the same samples.

An FMU is foreign machine code. Its description is read here; FMPy loads it in a worker process.
"""

from __future__ import annotations

import io
import platform
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ...case.case import TIME, Case
from ...case.io.document import fault, read_bytes
from ...case.io.element import Element, parse_xml
from ...case.io.foreign import too_large
from ...case.io.reference_samples import RATES
from ...errors import MOST_NAMED, CaseError, KincheckError, brief, shortened
from ...extras import how_to_install, installed_version
from ...harness.trajectory_check import Reported
from ...trajectory import Array
from ...unit_text import value_text
from .engine import RecordedEngine
from .meaning import MAP, Meaning, Reader, Use, inputs_of, unit_of
from .readers import Column, Head, Recording
from .samples import samples_of
from .sweep import at_own_samples

LARGEST_FMU, LARGEST_DESCRIPTION = 1_000_000_000, 64_000_000
# Sizes when unpacked; beyond the usual one an FMU shrinks no more than by this ratio.
USUAL_SIZE, RATIO = 256_000_000, 20
LESS = "export it without resources"
_REALS = ("Real", "Float64")
# Halving the step of a method of first order halves its error: the rest is as large as the change.
# Once more for higher orders.
_SAFE = 2.0


@dataclass(frozen=True)
class Variable:
    """A number of an FMU; `free` says whether it may be set over time."""

    head: Head
    reference: int
    free: bool


@dataclass(frozen=True)
class FmuEngine:
    """An FMU behind the protocol of engines; see `Engine`.

    Attributes:
        inputs, outputs: variables as drivers and as outputs of the case, by their names.
        stepping: whether it is driven as a co-simulation, and not as a model.
    """

    file: Path
    case: Case
    variables: Sequence[Variable]
    inputs: Mapping[str, Use]
    outputs: Mapping[str, Use]
    fmi: int
    tool: str
    token: str
    identifier: str
    stepping: bool
    mode = "simulate"
    loop = "python"
    untimed = True

    @property
    def name(self) -> str:
        """The stem of the file."""
        return self.file.stem

    @property
    def settings(self) -> Mapping[str, Any]:
        """File, kind, and variables by their meaning."""
        kind = "co-simulation" if self.stepping else "model exchange"
        uses = {**self.inputs, **self.outputs}
        named = {name: self.variables[use.column].head.name for name, use in uses.items()}
        return {"file": self.file.name, "fmi": self.fmi, "kind": kind, "variables": named}

    def version(self) -> str | None:
        """Return the tool behind the FMU, or None without FMPy."""
        found = installed_version("fmu")
        return found and f"{self.tool or 'unknown tool'}, FMPy {found}"

    def unsupported(self, case: Case) -> str | None:
        """Return a reason for every case but the one of the FMU."""
        same = case.name == self.case.name
        return None if same else f"{self.name} is an FMU of {self.case.name}"

    def build(self, case: Case) -> None:
        """Do nothing: each solve loads the FMU anew, without states of the last."""

    def solve(self, model: None, case: Case, tol: float) -> Reported:
        """Return the outputs of the FMU at the samples."""
        path = case.sweep.path
        order = np.argsort(path.times, kind="stable")
        times = path.times[order]
        # a case of one driver has no time of its own, and few tools start before zero
        start = float(times[0]) if self.inputs else 0.0
        found = self._run(case, times, start)
        half = np.zeros_like(found)
        notes = self._notes()
        if self.stepping and len(times) > 1:
            between = np.sort(np.concatenate([times, 0.5 * (times[1:] + times[:-1])]))
            finer = self._run(case, between, start)[::2]
            half, found = _SAFE * np.abs(finer - found), finer
            if half.any():
                notes.append(f"{self.name}: half the step changes {self._changes(half)}")
        back = np.empty_like(order)
        back[order] = np.arange(len(order))
        columns = {
            use.column: Column(self.variables[use.column].head, found[back, k], half[back, k])
            for k, use in enumerate(self.outputs.values())
        }
        recording = Recording(self.file, columns, self.tool, notes=notes)
        samples = samples_of(case, recording, Meaning(self.outputs, {}), whole=True)
        return RecordedEngine(self.name, samples, at_own_samples(case)).report(case)

    def _notes(self) -> list[str]:
        """Return notes on inputs at their start values, and drivers without an input."""
        taken = {use.column for use in self.inputs.values()}
        left = [v.head.name for k, v in enumerate(self.variables) if v.free and k not in taken]
        notes = list[str]()
        if left:
            listed = shortened(left, MOST_NAMED)
            notes.append(f"{self.name}: inputs without a driver keep their start values: {listed}")
        if not self.inputs:
            notes.append(f"{self.name}: no driver is an input: it moves by time alone")
        return notes

    def _changes(self, half: Array) -> str:
        """Return by how much half the step changes each output."""
        sizes = (half.max(axis=0) / _SAFE).tolist()
        each = zip(self.outputs.items(), sizes, strict=True)
        texts = [f"{n} by {value_text(f'{x:.2g}', use.si)}" for (n, use), x in each if x]
        return f"{shortened(texts, MOST_NAMED)}: twice as much is allowed"

    def _run(self, case: Case, times: Array, start: float) -> Array:
        """Return the mapped outputs at increasing times, in units of the FMU, shape (n, outputs).

        Inputs are set before the step to their sample, and not at its beginning: the outputs would
        be one sample late.
        """
        reals, values = self._inputs(case, times)
        wanted = [self.variables[use.column].reference for use in self.outputs.values()]
        fmpy: Any = import_module("fmpy")
        module: Any = import_module(f"fmpy.fmi{self.fmi}")
        kind = f"FMU{self.fmi}{'Slave' if self.stepping else 'Model'}"
        at = times - start
        found = np.empty((len(times), len(wanted)))
        with tempfile.TemporaryDirectory(prefix="kincheck-") as folder:
            fmpy.extract(str(self.file), folder)
            unit = getattr(module, kind)(
                guid=self.token,
                unzipDirectory=folder,
                modelIdentifier=self.identifier,
                instanceName="kincheck",
            )
            read = unit.getReal if self.fmi == 2 else unit.getFloat64
            write = unit.setReal if self.fmi == 2 else unit.setFloat64
            unit.instantiate()
            try:
                first = float(at[0])
                if self.fmi == 2:
                    unit.setupExperiment(startTime=first)
                    unit.enterInitializationMode()
                else:
                    unit.enterInitializationMode(startTime=first)
                if reals:
                    write(reals, values[0].tolist())
                unit.exitInitializationMode()
                if not self.stepping:
                    (unit.newDiscreteStates if self.fmi == 2 else unit.updateDiscreteStates)()
                    unit.enterContinuousTimeMode()
                for k, time in enumerate(at.tolist()):
                    if k and not self.stepping:
                        unit.setTime(time)
                    if reals:
                        write(reals, values[k].tolist())
                    if k and self.stepping and time > at[k - 1]:
                        unit.doStep(float(at[k - 1]), time - float(at[k - 1]))
                    found[k] = read(wanted)
                unit.terminate()
            finally:
                unit.freeInstance()
        return found

    def _inputs(self, case: Case, times: Array) -> tuple[list[int], Array]:
        """Return the references of driven inputs, and their values at times, in units of the FMU,
        shape (n, inputs).
        """
        mechanism, path = case.mechanism, case.sweep.path
        references, values = list[int](), list[Array]()
        for driver in mechanism.drivers:
            orders = path.drive([driver.name], times)[:, 0]
            design = (mechanism.design_value(driver.name), 0.0, 0.0)
            for ending, x, zero in zip(RATES, orders, design, strict=True):
                use = self.inputs.get(driver.name + ending)
                if use is not None:
                    variable = self.variables[use.column]
                    _, size, offset = unit_of(self.file, variable.head, use)
                    references.append(variable.reference)
                    values.append((x + zero - offset) / (use.sign * size))
        return references, np.stack(values, axis=-1) if values else np.zeros((len(times), 0))


def read_fmu(file: Path, case: Case, maps: Sequence[str]) -> FmuEngine:
    """Return an FMU as an engine of a case.

    Args:
        maps: texts of --map, between variables and drivers or outputs.

    Raises:
        CaseError: it is no FMU that can run here, or a text does not fit.
        KincheckError: FMPy is not installed.
    """
    if installed_version("fmu") is None:
        raise KincheckError(f"{file}: --fmu needs FMPy: {how_to_install('fmu')}")
    root, names = _description(file)
    fmi = 2 if root.attributes.get("fmiVersion", "").startswith("2.") else 3
    if not root.attributes.get("fmiVersion", "").startswith(("2.", "3.")):
        version = root.attributes.get("fmiVersion", "none")
        raise root.fault(f"found FMI {version}, expected 2 or 3. Export it anew")
    _require_binary(file, names, fmi)
    token = root.attributes.get("guid" if fmi == 2 else "instantiationToken", "")
    tool = root.attributes.get("generationTool", "")
    kinds = {
        kind: each.attributes.get("modelIdentifier", "")
        for kind in ("ModelExchange", "CoSimulation")
        for each in root.findall(kind)
    }
    states = any(True for s in root.findall("ModelStructure") for _ in _states(s, fmi))
    stepping = "CoSimulation" in kinds and (states or "ModelExchange" not in kinds)
    if not stepping and (states or "ModelExchange" not in kinds):
        problem = (
            "found no co-simulation, expected one of a model with states, which needs a solver"
        )
        raise fault(file, "", f"{problem}. Export it for co-simulation")
    variables = _variables(root)
    meaning = Reader(file, case, [each.head for each in variables]).read(maps)
    numbers = {name: use for name, use in meaning.numbers.items() if name != TIME}
    known = inputs_of(case)
    inputs = {name: use for name, use in numbers.items() if name in known}
    outputs = {name: use for name, use in numbers.items() if name not in known}
    for name, use in numbers.items():
        head = variables[use.column].head
        if name in inputs and not variables[use.column].free:
            problem = f"found {brief(head.name)} for {name}, expected an input of the FMU"
            raise fault(file, MAP, f'{problem}. Say {MAP} "INPUT={name}"')
        if not (use.unit or head.unit or use.si == "1"):
            problem = f"found no unit of {head.name}, expected one of {use.si}"
            raise fault(file, MAP, f'{problem}. Say {MAP} "{head.name}={name} [UNIT]"')
        unit_of(file, head, use)
    if not outputs:
        listed = shortened([v.head.name for v in variables if not v.free], MOST_NAMED)
        problem = f"found no output of the case among {listed}, expected one"
        raise fault(file, MAP, f'{problem}. Say {MAP} "VARIABLE=OUTPUT"')
    identifier = kinds["CoSimulation" if stepping else "ModelExchange"]
    found = tuple(variables), inputs, outputs, fmi, tool, token, identifier, stepping
    return FmuEngine(file, case, *found)


def _description(file: Path) -> tuple[Element, Sequence[str]]:
    """Return the model description and the names of all files in an FMU."""
    data = read_bytes(file, LARGEST_FMU, LESS)
    try:
        # machine code shrinks to a third, and tables to a tenth
        if problem := too_large(data, min(max(USUAL_SIZE, RATIO * len(data)), 4 * LARGEST_FMU)):
            raise fault(file, "", f"{problem}: {LESS}")
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = archive.namelist()
            size = archive.getinfo("modelDescription.xml").file_size
            if size > LARGEST_DESCRIPTION:
                raise fault(file, "", f"describes itself in {size} bytes. Export fewer variables")
            text = archive.read("modelDescription.xml").decode("utf-8")
    except CaseError:  # it is a ValueError too
        raise
    except (zipfile.BadZipFile, zlib.error, ValueError, KeyError, RuntimeError, EOFError, OSError):
        problem = "found no model description in a zip archive, expected an FMU"
        raise fault(file, "", f"{problem}. Export it anew") from None
    return parse_xml(file, text), names


def _require_binary(file: Path, names: Sequence[str], fmi: int) -> None:
    """Refuse an FMU without a binary for this machine."""
    system = {"linux": "linux", "darwin": "darwin", "win32": "windows"}.get(sys.platform, "other")
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower())
    own = f"{machine or platform.machine()}-{system}"
    if fmi == 2:
        short = {"windows": "win"}.get(system, system)
        own = f"{short}{64 if sys.maxsize > 2**32 else 32}"
    there = sorted({name.split("/")[1] for name in names if name.startswith("binaries/")} - {""})
    if own not in there:
        known = ", ".join(map(brief, there[:MOST_NAMED])) or "no machine"
        raise fault(file, "", f"has binaries for {known}, this is {own}. Export it for {own}")


def _states(structure: Element, fmi: int) -> Sequence[Element]:
    if fmi == 2:
        return [u for each in structure.findall("Derivatives") for u in each.findall("Unknown")]
    return [*structure.findall("ContinuousStateDerivative")]


def _variables(root: Element) -> list[Variable]:
    """Return the numbers of an FMU that change over time."""
    units = {
        kind.attributes.get("name", ""): real.attributes.get("unit", "")
        for types in root.findall("TypeDefinitions")
        for kind in types.children
        for real in ([kind] if kind.tag == "Float64Type" else kind.findall("Real"))
    }
    found = list[Variable]()
    for each in (v for variables in root.findall("ModelVariables") for v in variables.children):
        kinds = [each] if each.tag in _REALS else [e for e in each.children if e.tag in _REALS]
        own = each.attributes
        if not kinds or own.get("causality") in ("parameter", "calculatedParameter", "independent"):
            continue
        reference = own.get("valueReference", "")
        if not (reference.isascii() and reference.isdigit() and len(reference) < 10):
            raise each.fault("valueReference: expected a whole number. Export the FMU anew")
        type_ = kinds[0].attributes
        unit = type_.get("unit") or units.get(type_.get("declaredType", ""), "")
        head = Head(own.get("name", ""), unit)
        found.append(Variable(head, int(reference), own.get("causality") == "input"))
    return found
