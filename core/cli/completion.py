"""kincheck completion: print the completion script of a shell."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

from ..options import (
    argument,
    options,
)
from .parser import Command
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


@options
class Completion(Command):
    """Print a shell script for the completion of commands, options, built-in cases, engines and
    files. Repeat this after an update.
    """

    about: ClassVar[str] = "print the completion script of a shell"
    epilog: ClassVar[str | None] = (
        "bash: echo 'eval \"$(kincheck completion bash)\"' >> ~/.bashrc. zsh: kincheck"
        " completion zsh > a folder of $fpath, as _kincheck. tcsh: kincheck completion tcsh >"
        " ~/.kincheck.tcsh, and source that in ~/.tcshrc. Then open a new shell."
    )
    shell: str = argument(", ".join(SHELLS), "SHELL", choices=SHELLS)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        import shtab

        from ..case.models.hardpoints.templates import TEMPLATES
        from ..joints import Joint
        from ..studies.stress.families import Family
        from .main import parser

        names = {
            **{
                each: [*dict.fromkeys((*registry.engines, *registry.simulations))]
                for each in ENGINES
            },
            "family": [*Family.registry],
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
        preamble: Any = {self.shell: PREAMBLE[self.shell].format(names=" ".join(registry.cases()))}
        print(shtab.complete(found, self.shell, preamble=preamble))
        return Status.WITHIN


def _below(parser: Any) -> Iterable[Any]:
    """Yield the parsers of all commands below a parser."""
    for each in parser.commands().values():
        yield each
        yield from _below(each)
