"""kincheck list: list cases and engines, or the types known to case files."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

from ..extras import how_to_install, installed_version, is_extra
from ..options import (
    joint_types,
    options,
    switch,
    verbosity,
)
from .parser import Command
from .registry import Registry, Status

if TYPE_CHECKING:
    from rich.console import Console

    from ..harness.engine import Engine

SOURCE_WIDTH = 100
"""Longest line of the docstrings that `--schema` prints [characters]."""
BROKEN = 96
"""Shortest length, with the next word, of a line that may have been broken [characters]."""
CUT = {"no_wrap": True, "overflow": "ellipsis", "crop": True}


@options
class List(Command):
    """List the built-in cases with the kind and source of their references, and the engines with
    the installed versions (kincheck doctor also imports them); or list the keys and types of files.
    """

    about: ClassVar[str] = "list cases and engines"
    schema: bool = switch("list the keys of a case file, and of a file of variations")
    joints: bool = switch("list the types a case file can name: joints, drivers, motions")
    outputs: bool = switch("list the types of outputs a case file can name, with their signs")
    quiet: bool = verbosity("print only the names: cases, then engines")
    verbose: bool = verbosity("print sources in full on narrow terminals, too", "-v")
    joint_type: tuple[str, ...] = joint_types()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..report.terminal import page

        console = page(None)
        # a line for each case: cut at the edge of a terminal, whole in a pipe
        how: Any = {"soft_wrap": True} if self.verbose or not console.is_terminal else CUT
        print_line = partial(console.print, **how)
        if self.schema or self.joints or self.outputs:
            _print_references(self, console)
            return Status.WITHIN
        cases = registry.cases()
        if self.quiet:
            print(*cases, *dict.fromkeys((*registry.engines, *registry.simulations)), sep="\n")
            return Status.WITHIN
        print_line("cases:")
        for name in cases:
            kind, source = registry.summary(name)
            print_line(f"  {name:{max(map(len, cases))}}  {kind.replace('_', ' '):16}  {source}")
        print_line("engines:")
        engines: list[Engine] = [
            *map(registry.engine, registry.engines),
            *(registry.engine(name, "simulate") for name in registry.simulations),
        ]
        width = max(len(engine.name) for engine in engines)
        for engine in engines:
            version = _version(engine)
            state = (
                f"not installed: {how_to_install(engine.name)}"
                if version is None
                else f"{version}  {engine.mode}, loop: {engine.loop}"
            )
            console.print(f"  {engine.name:{width}}  {state}", soft_wrap=True)
        return Status.WITHIN


def _version(engine: Engine) -> str | None:
    """Return the installed version of an engine; a simulator with an extra is not imported."""
    from ..harness.engine import versions

    return installed_version(engine.name) if is_extra(engine.name) else versions([engine])[0]


def _print_references(options: List, console: Console) -> None:
    """Print keys and types, with whole lines for a pipe and broken lines for a terminal."""
    from ..case.io import catalogue
    from ..report.terminal import LOG_WIDTH, indented, unheaded

    if options.schema:
        lines = [*_keys()]
        if console.width < SOURCE_WIDTH:
            lines = [part for line in _joined(lines) for part in _hung(line, console.width)]
        console.print(*lines, sep="\n", soft_wrap=True)
    if console.width >= LOG_WIDTH:
        lines = [
            *(catalogue.catalogue() if options.joints else ()),
            *(catalogue.output_catalogue() if options.outputs else ()),
        ]
        if lines:
            console.print(*lines, sep="\n", soft_wrap=True)
        return
    for wanted, remarks, tables in (
        (options.joints, catalogue.ON_TYPES, catalogue.type_tables),
        (options.outputs, (), catalogue.output_tables),
    ):
        if wanted:
            console.print(*remarks, sep="\n")
        for heading, rows in tables().items() if wanted else ():
            console.print(heading)
            console.print(indented(unheaded(rows)))
    if options.outputs:
        console.print(catalogue.ON_OUTPUTS)


def _keys() -> Iterator[str]:
    """Yield the lines on the keys of case and variation files, from their readers."""
    from ..case.io import schema
    from ..studies.variation import variation_schema

    for module in (schema, variation_schema):
        what, _, keys = (module.__doc__ or "").partition("Reference. ")
        yield from (what.splitlines()[0], "", *keys.splitlines(), "")


def _joined(lines: Sequence[str]) -> list[str]:
    """Return the lines, joined where only the width of the source file broke them: the next line
    stands below the text, begins no key, and its first word did not fit.
    """
    found: list[str] = []
    last = ""
    for line in lines:
        text = line.lstrip()
        new = not text or re.match(r"\(?\w+\)? = ", text)
        broken = not new and last and len(last) + 1 + len(text.split()[0]) > BROKEN
        if broken and len(line) - len(text) == _start(found[-1]):
            found[-1] += f" {text}"
        else:
            found.append(line)
        last = line
    return found


def _start(line: str) -> int:
    """Return the column of a line's text: after its indentation, or after a key and its gap."""
    found = re.match(r" *(?:\S.*?\S {2,}(?=\S))?", line)
    return found.end() if found else 0


def _hung(line: str, width: int) -> list[str]:
    """Return the line in parts that fit the width, aligned below its text."""
    parts = textwrap.wrap(
        line,
        width,
        subsequent_indent=" " * _start(line),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return parts or [""]
