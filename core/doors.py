"""Doors: the offers of extensions to kincheck, and the extensions at hand.

An extension is a folder of `core/extensions` or `adapters`, or an installed package of someone
else, with one `EXTENSION = Extension(__name__, ...)`. The kernel asks here and imports no extension
by name, so a folder can be deleted without a change elsewhere.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypedDict, cast

from .errors import KincheckError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint
    from typing import Unpack

FOLDERS = "kincheck.core.extensions", "kincheck.adapters"
"""Packages whose subpackages may be extensions."""

GROUP = "kincheck.extensions"
"""Entry points of extensions in other packages: NAME = "module:EXTENSION"."""

_Table = Mapping[str, str]


class Doors(TypedDict, total=False):
    """Offers of an extension by kind. A value "module:name" is an object in a module of its folder,
    which is imported on use.

    Attributes:
        commands: class of each command of the command line; see `cli.parser.Command`.
        public: object of each name in the package kincheck.
        schemas: type, or function for the JSON Schema, of each kind of file.
        keys: docstring with the keys of a kind of file behind "Reference. ".
        completions: names to complete as values of each option.
        engines: class of each engine in projection mode.
        equilibria: function for the equilibria of a case by an engine, for engines
            "native" and "projection"; see `harness.engine.Balancing`.
        simulations: function without arguments for each engine in simulate mode.
        readers: readers of files; see `case.io.readers.Reader`.
        references: function for the case with a file of `--reference` as its reference, and notes;
            see `cli.shared_options.with_references`.
        closings: function for a case without rows that are redundant within a tolerance;
            see `case.io.case_file`.
        motions: type of a driver's motion in case files; see `mechanism.motions.Motion`.
        floors: function for the time of a simulator's compiled code alone, by an engine and a case.
        lines: function for the keys of a text with their lines, by the suffix of a file; see
            `case.io.lines`.
        compilers: compiler of plans to machine code; see `program.executor.Compiler`.
        methods: preparation of large mechanisms for paths, by `kinematics.motion_solver.Method`.
        sections: tables of case files with their outputs; see `case.io.sections.CaseSection`.
        sources: options added to commands with engines; see `cli.engine_source.EngineSource`.
        forms: options for further forms of a page; see `cli.forms.Form`.
        writers: function to write a mechanism in each format; see `case.io.model_writer`.
        codes: function for the files of a solved case in a language, by their names.
        formats: who reads each format, for the help.
        converters: function from a model's file to the text saved by a simulator.
        views: further forms of a result, and of a mechanism in a notebook; see `tabular`.
        proposals: function for the least moves of places that bring outputs of a case into bands;
            see `live.table`.
        styles: formulation of a mechanism in each row style; see `kinematics.formulation.styles`.
        suspicions: function for the suspicion of a case's reference, or of native, by the records;
            see `harness.provenance.Suspicion`.
        steppers: script of each stepper of free motion; see `adapters.steppers.scripts`.
    """

    commands: _Table
    public: _Table
    schemas: _Table
    keys: _Table
    completions: _Table
    engines: _Table
    equilibria: _Table
    simulations: _Table
    readers: _Table
    references: _Table
    closings: _Table
    motions: _Table
    floors: _Table
    lines: _Table
    compilers: _Table
    methods: _Table
    sections: _Table
    sources: _Table
    forms: _Table
    writers: _Table
    codes: _Table
    formats: _Table
    converters: _Table
    views: _Table
    proposals: _Table
    styles: _Table
    suspicions: _Table
    steppers: _Table


class Extension:
    """An extension: its folder, what it needs, and its offers.

    Attributes:
        package: `__name__` of the folder; its last part is the extension's name.
        needs: names of the extensions it imports; without one of them it is off.
        offers: its offers by kind.
    """

    def __init__(self, package: str, needs: Sequence[str] = (), **offers: Unpack[Doors]) -> None:
        """Take the parts.

        Raises:
            TypeError: there is no such kind of offer.
        """
        if unknown := offers.keys() - Doors.__annotations__:
            raise TypeError(f"{package}: extensions offer no {', '.join(sorted(unknown))}")
        self.package, self.needs, self.offers = package, needs, offers

    @property
    def name(self) -> str:
        """The last part of the package's name."""
        return self.package.rpartition(".")[2]


@dataclass(frozen=True)
class Offer:
    """One object that an extension offers.

    Attributes:
        extension: the extension.
        where: module and name of the object, as "module:name".
    """

    extension: Extension
    where: str

    def load(self) -> Any:
        """Import the module, and return the object."""
        module, _, name = self.where.partition(":")
        return getattr(import_module(f".{module}", self.extension.package), name)


@cache
def extensions() -> Mapping[str, Extension]:
    """Return the extensions whose needs are there, by name, in the order of their names.

    Raises:
        KincheckError: an installed package has an extension with the name of another.
    """
    found = {each.name: each for each in sorted(_of_folders(), key=lambda each: each.name)}
    for point in entry_points(GROUP).values():
        if point.name in found:
            raise KincheckError(
                f"Two extensions are named {point.name!r}. Rename the entry point of"
                f" {point.dist.name if point.dist else point.value}, or uninstall it."
            )
        found[point.name] = point.load()
    while lacking := [name for name, each in found.items() if not {*each.needs} <= {*found}]:
        for name in lacking:
            del found[name]
    return found


def offers(kind: str) -> dict[str, Offer]:
    """Return what all extensions offer of a kind, a key of `Doors`, by name.

    Raises:
        KincheckError: two extensions offer the same name.
    """
    found: dict[str, Offer] = {}
    for extension in extensions().values():
        for name, where in cast("_Table", extension.offers.get(kind, {})).items():
            if name in found:
                raise KincheckError(
                    f"The extensions {found[name].extension.name} and {extension.name} both offer"
                    f" {name!r} under {kind}. Remove one of them."
                )
            found[name] = Offer(extension, where)
    return found


@cache
def entry_points(group: str) -> Mapping[str, EntryPoint]:
    """Return the entry points of a group in the installed packages, by name."""
    from importlib import metadata  # slow

    return {each.name: each for each in metadata.entry_points(group=group)}


def _of_folders() -> Iterator[Extension]:
    for package in FOLDERS:
        for _, name, is_folder in pkgutil.iter_modules(import_module(package).__path__):
            if is_folder and hasattr(folder := import_module(f"{package}.{name}"), "EXTENSION"):
                yield folder.EXTENSION
