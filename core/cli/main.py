"""The command line. Only this module knows adapters and cases; it loads them, and all slow imports,
on use.
"""

from __future__ import annotations

import argparse
import errno
import os
import shlex
import sys
import traceback
from collections.abc import Callable, Sequence
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol, TextIO, TypeVar

from ..errors import KincheckError, OpenError
from ..extras import THREADS
from ..harness.interrupts import Terminated, listening, status_of, words_of
from ..options import function_of
from ..version import VERSION
from . import every_command
from .parser import Parser, add_command

if TYPE_CHECKING:
    from .registry import Registry

FULL = errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO
"""Error numbers of a full disk at standard output; other files have their own messages."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status."""
    interrupt: KeyboardInterrupt | None = None
    try:
        with listening() as interrupts:
            status = _done(sys.argv[1:] if argv is None else list(argv))
            interrupt = interrupts.held
    except KeyboardInterrupt as raised:
        interrupt, status = raised, 0
    if interrupt is None:
        return status
    # otherwise the command has printed it
    if status not in (ended := (status_of(KeyboardInterrupt()), status_of(Terminated()))):
        print(f"kincheck: {words_of(interrupt)}", file=sys.stderr)
    return status if status in ended else status_of(interrupt)


def _done(argv: list[str]) -> int:
    """Return the exit status of the command in the arguments."""
    _be_able_to_print()
    from ..report.progress import complain
    from .registry import Status

    try:
        options = parser(argv).parse_args(
            argv, argparse.Namespace(command=shlex.join(["kincheck", *argv]))
        )
    except SystemExit as end:  # argparse has printed why
        return int(end.code or 0)
    try:
        if getattr(options, "one_thread", False):  # before numpy is loaded
            for name in THREADS:
                os.environ.setdefault(name, "1")
        if getattr(options, "joint_type", ()):
            from .joint_loading import load_joint

            for where in options.joint_type:
                load_joint(where)
        return _flush_output(int(options.do(options, registry())))
    except OpenError as error:
        return _ask(argv, error)
    except KincheckError as error:
        complain(str(error).splitlines())
    except SystemExit as end:
        # raised by an engine or a user's module: those of the parser are handled above
        where = traceback.extract_tb(end.__traceback__)[-1]
        complain(
            [
                f"{where.filename}, line {where.lineno}, ended the program with status"
                f" {end.code!r}. Correct it, or leave it out."
            ]
        )
    except BrokenPipeError:  # the reader has closed our output
        _print_no_more()
    except OSError as error:
        if error.errno in FULL and error.filename is None:
            complain(
                [
                    f"standard output cannot be written ({error.strerror}). Requested files are"
                    " written."
                ]
            )
            _print_no_more()
        else:
            traceback.print_exc()
    except Exception:  # a defect in kincheck is not status 1, which means a deviation
        traceback.print_exc()
    return Status.FAILED


def _ask(argv: list[str], error: OpenError) -> int:
    """Show the guess of what a file leaves open, as a command line with why. At a terminal, Enter
    takes it; elsewhere the command ends, for nobody has agreed.
    """
    from ..report.progress import complain
    from .registry import Status

    whole = [*argv, *error.options]
    complain([f"{error.file} leaves open what options state. The best guess:", *error.why])
    for path, text in error.writes.items():
        try:
            path.write_text(text, encoding="utf-8")
        except OSError as problem:
            complain([f"{path} cannot be written ({problem.strerror}). Write it yourself:", text])
    complain([f"Take it: {shlex.join(['kincheck', *whole])}"])
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return Status.FAILED
    print("Enter takes it, any other answer ends: ", end="", file=sys.stderr, flush=True)
    return _done(whole) if sys.stdin.readline() == "\n" else Status.FAILED


def _be_able_to_print() -> None:
    """Make standard streams printable: characters missing in the encoding become question marks,
    and the null device replaces a closed stream.
    """
    for name in ("stdout", "stderr"):
        stream: TextIO | None = getattr(sys, name)
        if stream is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8"))
        elif isinstance(stream, TextIOWrapper):  # not a caller's replacement
            stream.reconfigure(errors="replace")


def _flush_output(status: int) -> int:
    """Flush the output of a finished command; return its status. A closed reader is no failure."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _print_no_more()
    return status


def _print_no_more() -> None:
    from ..report.terminal import print_no_more

    print_no_more(sys.stdout)


def registry() -> Registry:
    """Return the registry of engines and cases."""
    from ... import adapters, cases
    from . import class_loading
    from .registry import Registry

    others = class_loading.names_of_entry_points((*adapters.ENGINES, *adapters.SIMULATIONS))

    def engine(name: str, mode: str = "projection") -> Any:
        if name in others:
            point = class_loading.entry_points(class_loading.GROUP)[name]
            return class_loading.create_engine(name, point.load())
        return adapters.engine(name, mode)

    return Registry(
        (*adapters.ENGINES, *others),
        engine,
        cases.names,
        cases.load,
        cases.summary,
        tuple(adapters.SIMULATIONS),
    )


_Options = ParamSpec("_Options")
_Answer = TypeVar("_Answer")
_Answer_co = TypeVar("_Answer_co", covariant=True)


class _Command(Protocol[_Answer_co]):
    def answer(self, registry: Registry) -> _Answer_co: ...


def function(
    name: str, command: Callable[_Options, _Command[_Answer]]
) -> Callable[_Options, _Answer]:
    """Return the function of a command: its arguments are the options."""
    found: Any = function_of(name, command, lambda options: options.answer(registry()))
    return found


def parser(argv: Sequence[str]) -> Parser:
    """Return the parser of the command at the start of the arguments, or of all commands. Each
    takes a millisecond to build.
    """
    found = Parser(
        prog="kincheck",
        description="Cross-validation of the kinematics and forces of multibody systems.",
    )
    found.add_argument("--version", action="version", version=f"kincheck {VERSION}")
    commands = found.add_subparsers(title="commands", required=True, metavar="COMMAND")
    known = every_command()
    named = [name for name in known if argv and argv[0] == name]
    for name in named or known:
        add_command(commands, name, known[name].load())
    return found
