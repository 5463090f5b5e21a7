"""The parser of the command line: argparse with errors that name the command and the remedy."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator, Sequence
from typing import Any, NoReturn, cast

from ..errors import brief, similar, unknown


class Parser(argparse.ArgumentParser):
    """A parser whose errors show the short usage of its own command.

    argparse reports unknown options and superfluous arguments after all other errors, with the
    usage of the outermost parser. Here their own command reports them first.
    """

    def parse_known_args(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, args: Any = None, namespace: Any = None
    ) -> Any:
        """Parse the arguments; exit with a message at an unknown argument."""
        known = self._option_string_actions
        for word in self._own_options(args or ()):
            name = word.partition("=")[0] if word.startswith("--") else word[:2]
            if name not in known and not any(each.startswith(name) for each in known):
                self.error(f"there is no option {brief(name)!r}{self._remedy(name)}")
        namespace, others = super().parse_known_args(args, namespace)
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
