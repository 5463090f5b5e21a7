"""kincheck completion: print the completion script of a shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from typing import Any

from .registry import Registry, Status

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


def add(commands: Any) -> None:
    """Add the command to the parser."""
    completion: argparse.ArgumentParser = commands.add_parser(
        "completion",
        help="print the completion script of a shell",
        description=_complete.__doc__,
        epilog=(
            "bash: echo 'eval \"$(kincheck completion bash)\"' >> ~/.bashrc. zsh: kincheck"
            " completion zsh > a folder of $fpath, as _kincheck. tcsh: kincheck completion tcsh >"
            " ~/.kincheck.tcsh, and source that in ~/.tcshrc. Then open a new shell."
        ),
    )
    completion.set_defaults(do=_complete)
    completion.add_argument("shell", choices=SHELLS, metavar="SHELL", help=", ".join(SHELLS))


def _complete(options: argparse.Namespace, registry: Registry) -> int:
    """Print a shell script for the completion of commands, options, built-in cases, engines and
    files. Repeat this after an update.
    """
    import shtab

    from ..case.models.hardpoints.templates import TEMPLATES
    from ..joints import Joint
    from ..studies.stress.families import FAMILIES
    from .main import parser

    names = {
        **{each: [*dict.fromkeys((*registry.engines, *registry.simulations))] for each in ENGINES},
        "family": [*FAMILIES],
        "template": [*TEMPLATES],
        "to": [*registry.writers],
        "joint": sorted(Joint.registry),
        "export": [*registry.writers],
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
    preamble: Any = {
        options.shell: PREAMBLE[options.shell].format(names=" ".join(registry.cases()))
    }
    print(shtab.complete(found, options.shell, preamble=preamble))
    return Status.WITHIN


def _below(parser: Any) -> Iterable[Any]:
    """Yield the parsers of all commands below a parser."""
    for each in parser.commands().values():
        yield each
        yield from _below(each)
