"""Stages of USD as elements: prims with their properties, composed by usd-core.

Numbers in single precision are written with the fewest digits from which they can be read again: a
number typed by a person comes back as typed. Of a value with samples over time the first counts.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from ...case.io.document import fault, require_file, shown
from ...errors import CaseError, remedy, shortened, similar
from ...extras import library
from ..xml.element import DEEPEST, MOST_ELEMENTS, USD, Element, file_near, words

FLATTEN = "write all into one file: usdcat --flatten FILE -o flat.usda"
UNITS = ("metersPerUnit", "kilogramsPerUnit", "upAxis")
# Shapes make files long; scenes of whole plants have some hundred megabytes.
LARGEST_LAYER, MOST_LAYERS = 500_000_000, 1_000
MOST_NAMED = 3
_SINGLE, _TEXTS = words("half float"), words("token string")
_SCALARS = (*_SINGLE, *_TEXTS, *words("double bool int uint int64 uint64 uchar"))
_VECTORS = re.compile(r"(vector|point|normal|float|double|half)3[hfd]?|quat[hfd]")
# Their places are those of the prims; looks and shapes are of no use.
_LEFT_OUT = words("xformOp xformOpOrder primvars inputs outputs ui info")
_REASON = re.compile(r" : '(.*?)'\s*(?:\n|$)", re.DOTALL)
_LINE = re.compile(r".*?:(\d+):\d+: (?:parse error matching .* (?=at '))?(.*)", re.DOTALL)


def root_of_usd(file: Path) -> Element:
    """Return the stage of a file: an element with its units, and its prims in it.

    Raises:
        CaseError: it cannot be read, is too large, or takes files from elsewhere.
        KincheckError: usd-core is not installed.
    """
    names = ("Usd", "UsdGeom", "UsdPhysics", "UsdUtils", "Sdf", "Ar", "Tf")
    pxr = SimpleNamespace(
        **{each: library(f"reading {file.name}", f"pxr.{each}", "usd") for each in names}
    )
    quiet = pxr.UsdUtils.CoalescingDiagnosticDelegate()  # else it prints what it finds amiss
    try:
        _require_near(file, pxr)
        stage = pxr.Usd.Stage.Open(str(file.resolve()))
        if errors := [str(each) for each in stage.GetCompositionErrors()]:
            raise fault(file, "", f"cannot be composed: {shortened(errors, MOST_NAMED)}; {FLATTEN}")
        _require_units(file, stage)
        units = (
            _number_text(pxr.UsdGeom.GetStageMetersPerUnit(stage)),
            _number_text(pxr.UsdPhysics.GetStageKilogramsPerUnit(stage)),
            str(pxr.UsdGeom.GetStageUpAxis(stage)),
        )
        said = [each for each in UNITS if stage.HasAuthoredMetadata(each)]
        attributes = dict(zip(UNITS, units, strict=True)) | {"said": " ".join(said)}
        root = Element(file, USD, attributes, 1, words="the stage")
        prims = _Prims(file, pxr)
        root.children.extend(prims.inside(stage.GetPseudoRoot(), 1))
        cast("dict[str, str]", root.attributes)["off"] = " ".join(prims.off)
    except (pxr.Tf.ErrorException, UnicodeDecodeError) as error:
        raise _unreadable(file, error) from None
    finally:
        quiet.TakeUncoalescedDiagnostics()
    return root


def _unreadable(file: Path, error: Exception) -> CaseError:
    """Return the error of a file, with the first reason of the library."""
    try:
        text = str(error)
    except UnicodeDecodeError as inside:  # bytes of the file, quoted by the library
        text = str(inside)
    reason = " ".join((_REASON.findall(text) or [text])[0].split())
    line = _LINE.fullmatch(reason)
    key, what = (f"line {line[1]}", line[2]) if line else ("", reason)
    return fault(file, key, f"not valid USD: {what}; correct the file")


def _require_units(file: Path, stage: Any) -> None:
    """Refuse units that are misspelt or of another kind, in whose place others would be taken."""
    for key in stage.GetPseudoRoot().GetAllAuthoredMetadata():
        if key not in UNITS and similar(key, UNITS):
            raise fault(file, "", f"found {shown(key)} of the stage; {remedy(key, UNITS)}")
    for key in UNITS[:2]:
        value = stage.GetMetadata(key)
        if value is not None and not isinstance(value, int | float):
            raise fault(file, key, f"found {shown(value)}, expected a number; correct it")


def _require_near(file: Path, pxr: Any) -> None:
    """Refuse files from elsewhere than the folder of the file, one beside it, or below."""

    def refuse(what: str, problem: str) -> CaseError:
        return fault(file, "", f"{what} {problem}; {FLATTEN}")

    folder, resolver = file.parent.resolve(), pxr.Ar.GetResolver()
    suffixes = [f".{each}" for each in pxr.Sdf.FileFormat.FindAllFileFormatExtensions()]
    waiting, known = [str(file.resolve())], set[str]()
    while waiting:
        path = waiting.pop()
        package = _package(path, pxr)
        if path in known:
            continue
        known.add(path)
        if len(known) > MOST_LAYERS:
            raise refuse(f"found more than {MOST_LAYERS} layers,", "expected no more")
        own = file if package == str(file.resolve()) else Path(package)
        require_file(own, LARGEST_LAYER, "take out shapes")
        layer = pxr.Sdf.Layer.FindOrOpen(path)
        if layer is None:
            part = "" if path == str(file.resolve()) else shown(path)
            raise fault(file, part, "not valid USD; give a stage, .usda, .usdc or .usdz")
        for asset in filter(None, layer.GetCompositionAssetDependencies()):  # none: this layer
            wanted = pxr.Sdf.ComputeAssetPathRelativeToLayer(layer, asset)
            found = resolver.Resolve(wanted).GetPathString()
            outer = _package(found, pxr)
            near = bool(outer) and file_near(
                folder, os.path.relpath(Path(outer).resolve(), folder), suffixes
            )
            if not near:
                problem = "expected a file in the folder of the stage, in one beside it or below"
                missing = "which is elsewhere" if outer else "and there is none"
                raise refuse(f"found the reference {shown(asset)},", f"{problem}, {missing}")
            waiting.append(found)


def _package(path: str, pxr: Any) -> str:
    """Return the file of a layer: the package around it, if it is in one."""
    inside = pxr.Ar.IsPackageRelativePath(path)
    return pxr.Ar.SplitPackageRelativePathOuter(path)[0] if inside else path


class _Prims:
    """The prims of a stage during their reading.

    Attributes:
        count: how many are read.
        off: paths of others, which are not active.
    """

    def __init__(self, file: Path, pxr: Any) -> None:
        self.file, self.count, self.off = file, 0, list[str]()
        self.relationship, self.predicate = pxr.Usd.Relationship, pxr.Usd.TraverseInstanceProxies()
        self.time = pxr.Usd.TimeCode.EarliestTime()
        self.places = pxr.UsdGeom.XformCache(self.time)

    def inside(self, around: Any, depth: int) -> Iterator[Element]:
        """Yield the prims in another one: those that are defined, active and loaded."""
        self.off += [str(x.GetPath()) for x in around.GetAllChildren() if not x.IsActive()]
        for prim in around.GetFilteredChildren(self.predicate):
            path = str(prim.GetPath())
            kind = str(prim.GetTypeName()) or "def"
            element = Element(self.file, kind, {}, self.count, words=f"<{path}>")
            self.count += 1
            if self.count > MOST_ELEMENTS:
                raise element.too_many()
            if depth > DEEPEST:
                raise element.fault(f"nested more than {DEEPEST} deep; correct the file")
            if prim.HasAuthoredMetadata("clips"):
                raise element.fault(f"takes values from clips of other files; {FLATTEN}")
            attributes = {
                "name": prim.GetName(),
                "path": path,
                **dict(self._properties(element, prim)),
            }
            attributes["apis"] = " ".join(prim.GetPrimTypeInfo().GetAppliedAPISchemas())
            matrix = np.array(self.places.GetLocalToWorldTransform(prim), dtype=np.float64)
            attributes["matrix"] = " ".join(map(repr, matrix.ravel().tolist()))
            sets = prim.GetVariantSets()
            attributes["variants"] = ", ".join(
                f"{each} {sets.GetVariantSelection(each) or 'none'}" for each in sets.GetNames()
            )
            element = Element(self.file, kind, attributes, element.line, words=element.words)
            element.children.extend(self.inside(prim, depth + 1))
            yield element

    def _properties(self, element: Element, prim: Any) -> Iterator[tuple[str, str]]:
        """Yield names and texts of properties; of relationships the paths of their targets, of
        arrays, matrices and other kinds that nothing here is written in, the kind.
        """
        for each in prim.GetAuthoredProperties():
            name = str(each.GetName())
            if name.partition(":")[0] in _LEFT_OUT:
                continue
            if isinstance(each, self.relationship):
                yield name, " ".join(str(path) for path in each.GetTargets())
                continue
            kind = str(each.GetTypeName())
            if kind not in _SCALARS and not _VECTORS.fullmatch(kind):
                yield name, f"({kind})"
                continue
            value = each.Get(self.time)
            if value is None:  # blocked
                continue
            try:
                text = _text(kind, value)
            except (TypeError, ValueError, AttributeError):  # of another type than it says
                problem = f"{name}: found {shown(str(value))}, expected {kind}"
                raise element.fault(f"{problem}; correct it") from None
            yield name, text


def _text(kind: str, value: Any) -> str:
    """Return the text of a value of a type."""
    if kind in _TEXTS:
        return str(value)
    if kind == "bool":
        return str(value).lower()
    if kind in _SCALARS:
        return _number_text(value, single=kind in _SINGLE)
    numbers = [*value] if kind[:4] != "quat" else [value.GetReal(), *value.GetImaginary()]
    single = not (kind.endswith("d") or kind.startswith("double"))
    return " ".join(_number_text(number, single=single) for number in numbers)


def _number_text(number: float, *, single: bool = False) -> str:
    return str(np.float32(number)) if single else repr(float(number))
