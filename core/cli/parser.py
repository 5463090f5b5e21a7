"""The parser of the command line: argparse with errors that name the command and the remedy."""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import MISSING, Field, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, TypeVar, cast

from ..errors import KincheckError, brief, similar, unknown
from ..options import Option, flags_of, option_fields, options, with_values

if TYPE_CHECKING:
    from .registry import Registry

T = TypeVar("T")


class Parser(argparse.ArgumentParser):
    """A parser whose errors show the short usage of its own command.

    argparse reports unknown options and superfluous arguments after all other errors, with the
    usage of the outermost parser. Here their own command reports them first.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        # values such as -60mm:60mm are no options
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def parse_known_args(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, args: Any = None, namespace: Any = None
    ) -> Any:
        """Parse the arguments; exit with a message at an unknown argument."""
        known = self._option_string_actions
        for word in self._own_options(args or ()):
            name = word.partition("=")[0] if word.startswith("--") else word[:2]
            if name not in known and not any(each.startswith(name) for each in known):
                self.error(f"there is no option {brief(name)!r}{self._remedy(name)}")
        if args and not args[0].startswith("-") and not self._get_positional_actions():
            close = f"; say --case {brief(args[0])}" if "--case" in known else "; leave it out"
            self.error(f"{brief(args[0])!r} stands without an option{close}")
        namespace, others = super().parse_known_args(args, namespace)
        rest = [each for each in self._get_positional_actions() if each.nargs == "*"]
        if others and rest:  # argparse takes those before the first option alone
            more: Any = self._get_values(rest[0], others)
            setattr(namespace, rest[0].dest, [*getattr(namespace, rest[0].dest), *more])
            others = []
        if others:
            self.error(f"too many arguments: {' '.join(map(brief, others))}; leave them out")
        return namespace, others

    def error(self, message: str) -> NoReturn:
        """Print the short usage and the message, and exit with status 2."""
        required = [action for action in self._get_optional_actions() if action.required]
        usage = self.formatter_class(prog=f"{self.prog} [OPTION ...]")
        usage.add_usage(None, [*required, *self._get_positional_actions()], [])
        self.exit(
            2,
            f"{usage.format_help().strip()}   (all options: {self.prog} --help)\n"
            f"{self.prog}: error: {message}\n",
        )

    def commands(self) -> dict[str, Parser]:
        """Return the parsers of the commands by name; none for a command without subcommands."""
        found: dict[str, Parser] = {}
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction):  # pyright: ignore[reportPrivateUsage]
                found |= cast("Any", action).choices
        return found

    def arguments(self) -> tuple[argparse.Action, ...]:
        """Return the options and positional arguments of this parser."""
        return tuple(self._actions)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Refuse an unknown choice of an option, or an unknown command."""
        if action.choices is None or value in action.choices:
            return
        names = [str(each) for each in action.choices]
        if isinstance(action, argparse._SubParsersAction):  # pyright: ignore[reportPrivateUsage]
            self.error(unknown(str(action.metavar).lower(), str(value), names))
        close = similar(str(value), names)
        raise argparse.ArgumentError(
            action,
            f"{brief(str(value))!r} is none of {', '.join(names)}"
            + (f"; did you mean {close!r}?" if close else ""),
        )

    def _get_option_tuples(self, option_string: str) -> list[Any]:
        """Return the options that an abbreviation means: --eng is --engine, and not
        --engine-command, which only lengthens it.
        """
        found: list[Any] = cast("Any", super())._get_option_tuples(option_string)
        names = [each[1] for each in found]
        first = min(names, key=len, default="")
        return (
            [min(found, key=lambda each: len(each[1]))]
            if (found and all(name.startswith(f"{first}-") for name in names if name != first))
            else found
        )

    def _own_options(self, args: Sequence[str]) -> Iterator[str]:
        """Yield the options among the arguments, up to a command of this parser."""
        commands = self.commands()
        for word in args:
            if word == "--" or word in commands:
                return
            if re.match(r"--|-[A-Za-z]", word):  # not a negative number
                yield word

    def _remedy(self, option: str) -> str:
        """Return the remedy for an unknown option; empty if none is known."""
        own = {each.lstrip("-"): each for each in self._option_string_actions}
        if close := similar(option.lstrip("-"), own):
            return f"; did you mean {own[close]!r}?"
        having = [
            parser.prog
            for parser in self.commands().values()
            if option in parser._option_string_actions
        ]
        return f"; it belongs to {', '.join(having)}: give that first" if having else ""


@options
class Command:
    """A command: what it solves, as the function in Python does, and what it prints and writes.

    Attributes:
        about: what it does, in the list of commands.
        epilog: end of the help.
        one_thread: whether its matrices are so small that threads of libraries wait for each other.
        below: commands below this one, by name, with the heading of their list.
        LAST: options behind all others of the command.
        command: the command line.
    """

    about: ClassVar[str]
    epilog: ClassVar[str | None] = None
    one_thread: ClassVar[bool] = False
    below: ClassVar[Mapping[str, type[Command]]] = {}
    LAST: ClassVar[tuple[str, ...]] = ()
    command: str = field(default="", init=False)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line, and return the exit status."""
        raise NotImplementedError

    def unwritable(self, *names: str) -> list[str]:
        """Return messages on destinations that cannot be written, before the work starts.

        Args:
            names: files in the folder of --out; with none, --out is a file.
        """
        from .destinations import unwritable_of

        return unwritable_of(self, names)


def add_command(commands: Any, name: str, cls: type[Command], given: Collection[str] = ()) -> None:
    """Add a command to the parser.

    Args:
        given: options that stand before its name too.
    """
    parser: Parser = commands.add_parser(
        name, help=cls.about, description=cls.__doc__, epilog=cls.epilog
    )
    parser.set_defaults(do=partial(_run, cls), one_thread=cls.one_thread)
    known = add_options(parser, cls, given)
    if cls.below:
        below = parser.add_subparsers(title="commands", metavar="COMMAND")
        for each, other in cls.below.items():
            add_command(below, each, other, known)


def add_options(parser: argparse.ArgumentParser, cls: Any, given: Collection[str] = ()) -> set[str]:
    """Add the options of a class to a parser, and return their names in its namespace."""
    groups: dict[str, Any] = {"": parser}
    headings: dict[str, str] = {}
    for base in cls.__mro__:
        headings |= cast("Any", vars(base)).get("HEADINGS", {})
    known = set[str]()
    # headings of groups stand above those of the class's own options
    own = sorted(option_fields(cls), key=lambda found: bool(found[1] and found[1].heading))
    own.sort(key=lambda found: found[0].name in getattr(cls, "LAST", ()))
    for each, meaning, below in own:
        if meaning is None:
            known |= add_options(parser, below, given)
            continue
        where: Any = groups.get(meaning.heading)
        if where is None:
            where = parser.add_argument_group(meaning.heading, headings[meaning.heading])
            groups[meaning.heading] = where
        if meaning.exclusive:
            where = groups.get("-q") or parser.add_mutually_exclusive_group()
            groups["-q"] = where
        name = _name_of(each, meaning)
        known.add(name)
        facts: dict[str, Any] = {"help": meaning.help}
        if each.default is not MISSING:
            several = isinstance(each.default, tuple)
            facts["default"] = [*each.default] if several else each.default
        if meaning.environment:
            facts["default"] = os.environ.get(meaning.environment) or None
        if name in given:  # a default would overwrite what stands there
            facts["default"] = argparse.SUPPRESS
        if meaning.action != "store_true":
            facts |= {"type": _reader(meaning), "metavar": meaning.metavar}
            facts["choices"] = meaning.choices
        for key in ("nargs", "action", "required"):
            if value := getattr(meaning, key):
                facts[key] = value
        where.add_argument(*(flags_of(each, meaning) or [name]), **facts)
    return known


def _run(cls: type[Command], found: argparse.Namespace, registry: Registry) -> int:
    return with_values(values_of(cls, found), command=found.command).run(registry)


def _name_of(each: Field[Any], meaning: Option) -> str:
    """Return the name of an option in the namespace."""
    *_, last = [each.name, *flags_of(each, meaning)]
    return last.removeprefix("--").replace("-", "_")


def _reader(meaning: Option) -> Callable[[str], Any]:
    """Return a reader whose messages argparse prints."""
    read = meaning.read
    if read is str:
        return str

    def reader(text: str) -> Any:
        if read is Path and not text:  # which would be this folder
            raise argparse.ArgumentTypeError("found an empty name; give one, or leave it out")
        try:
            return read(text)
        except KincheckError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
        except ValueError:
            if meaning.choices:
                return text  # refused with the choices
            raise

    reader.__name__ = read.__name__  # in argparse's own messages
    return reader


def values_of(cls: type[T], found: argparse.Namespace) -> T:
    """Return the options of a class in the namespace of a parser."""
    values: dict[str, Any] = {}
    for each, meaning, below in option_fields(cls):
        if meaning is None:
            values[each.name] = values_of(below, found)
        else:
            value = getattr(found, _name_of(each, meaning))
            many: Any = value
            values[each.name] = tuple(many) if isinstance(value, list) else value
    return with_values(object.__new__(cls), **values)
