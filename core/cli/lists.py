"""Commands that print what kincheck knows: kincheck list, schema and completion."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import msgspec

from ..case.io.atomic_files import to_standard_output
from ..doors import Extension, Offer, offers
from ..extras import how_to_install, installed_version, is_extra
from ..options import argument, joint_types, options, switch, verbosity
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

    about = "list cases and engines"
    schema: bool = switch("list the keys of a case file, and of a file of variations")
    joints: bool = switch("list the types a case file can name: joints, drivers, motions")
    outputs: bool = switch("list the types of outputs a case file can name, with their signs")
    quiet: bool = verbosity("print only the names: cases, then engines")
    verbose: bool = verbosity("print sources in full on narrow terminals, too", "-v")
    joint_type: tuple[str, ...] = joint_types()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..harness.engine import versions
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
            print(*cases, *registry.every_engine, sep="\n")
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
            # a simulator with an extra is not imported
            name = engine.name
            version = installed_version(name) if is_extra(name) else versions([engine])[0]
            state = (
                f"not installed: {how_to_install(engine.name)}"
                if version is None
                else f"{version}  {engine.mode}, loop: {engine.loop}"
            )
            console.print(f"  {engine.name:{width}}  {state}", soft_wrap=True)
        return Status.WITHIN


def _print_references(options: List, console: Console) -> None:
    """Print keys and types, with whole lines for a pipe and broken lines for a terminal."""
    from ..case.io import catalogue
    from ..report.terminal import LOG_WIDTH, indent_table, table_without_heads

    if options.schema:
        lines = [*_keys()]
        if console.width < SOURCE_WIDTH:
            whole: dict[str, Any] = {"break_long_words": False, "break_on_hyphens": False}
            lines = [
                part
                for line in _join_broken_lines(lines)
                # aligned below its text
                for part in textwrap.wrap(
                    line, console.width, subsequent_indent=" " * _start(line), **whole
                )
                or [""]
            ]
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
            console.print(indent_table(table_without_heads(rows)))
    if options.outputs:
        console.print(*catalogue.on_outputs(), sep="\n")


def _keys() -> Iterator[str]:
    """Yield the lines on the keys of case and variation files, from their readers."""
    from ..case.io import schema

    for text in (schema.__doc__ or "", *(each.load() for each in offers("keys").values())):
        what, _, keys = text.partition("Reference. ")
        yield from (what.splitlines()[0], "", *keys.splitlines(), "")


def _join_broken_lines(lines: Sequence[str]) -> list[str]:
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


SCHEMAS = {
    "case": "case.io.catalogue:case_schema",
    "results": "harness.record:Results",
    "regression": "history.findings:Regressions",
}
"""The type of each file of the kernel, or the function that returns its schema, in core."""


def every_schema() -> Mapping[str, Offer]:
    """Return the types and functions of all kinds of files by name; those of extensions last."""
    core = Extension(__name__.rpartition(".cli.")[0])
    return {name: Offer(core, where) for name, where in SCHEMAS.items()} | offers("schemas")


def schema_of(name: str) -> dict[str, Any]:
    """Return the JSON Schema of a kind of file."""
    found = every_schema()[name].load()
    return msgspec.json.schema(found) if isinstance(found, type) else found()


@options
class PrintSchema(Command):
    """Print the JSON Schema of a file, for editors and validators, made from the types of its
    reader and writer.
    """

    about = "print the JSON Schema of a file"
    name: str = argument(
        f"one of {', '.join(every_schema())}; TOML files follow the schema of their content",
        "NAME",
        choices=[*every_schema()],
    )
    joint_type: tuple[str, ...] = joint_types()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        text = msgspec.json.format(msgspec.json.encode(schema_of(self.name)), indent=2)
        to_standard_output(text + b"\n")
        return Status.WITHIN


SHELLS = ("bash", "zsh", "tcsh")
FILES = ("FILE", "FILE.html", "RUN")
# Functions of the shells: engine options complete to engine names, cases to built-in names and
# files.
ENGINES = ("engine", "require")
PREAMBLE = {
    "bash": 'kincheck_cases() {{ compgen -W "{names}" -- "$1"; compgen -f -- "$1"; }}',
    "zsh": "kincheck_cases() {{ compadd {names}; _files; }}",
    "tcsh": "",
}


@options
class Completion(Command):
    """Print a shell script for the completion of commands, options, built-in cases, engines and
    files. Repeat this after an update.
    """

    about = "print the completion script of a shell"
    epilog = (
        "bash: echo 'eval \"$(kincheck completion bash)\"' >> ~/.bashrc. zsh: kincheck"
        " completion zsh > a folder of $fpath, as _kincheck. tcsh: kincheck completion tcsh >"
        " ~/.kincheck.tcsh, and source that in ~/.tcshrc. Then open a new shell."
    )
    shell: str = argument(", ".join(SHELLS), "SHELL", choices=SHELLS)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        import shtab

        from ..joints import Joint
        from .main import parser

        names = {
            **dict.fromkeys(ENGINES, registry.every_engine),
            "to": [*offers("writers")],
            "export": [*offers("writers")],
            "joint": sorted(Joint.registry),
            **{name: [*each.load()] for name, each in offers("completions").items()},
        }
        found = parser([])
        for each in (found, *_below(found)):
            for action in each.arguments():
                if action.metavar == "CASE":
                    action.complete = {  # pyright: ignore[reportAttributeAccessIssue]
                        "bash": "kincheck_cases",
                        "zsh": "kincheck_cases",
                        "tcsh": "f",
                    }
                elif action.metavar in FILES:
                    action.complete = shtab.FILE  # pyright: ignore[reportAttributeAccessIssue]
                elif action.metavar == "DIR":
                    action.complete = shtab.DIRECTORY  # pyright: ignore[reportAttributeAccessIssue]
                elif action.choices is None:
                    action.choices = names.get(action.dest)
        # a dictionary by shell, which the library's types omit
        preamble: Any = {self.shell: PREAMBLE[self.shell].format(names=" ".join(registry.cases()))}
        print(shtab.complete(found, self.shell, preamble=preamble))
        return Status.WITHIN


def _below(parser: Any) -> Iterable[Any]:
    """Yield the parsers of all commands below a parser."""
    for each in parser.commands().values():
        yield each
        yield from _below(each)
