"""The options -q and -v, to print less or more."""

from __future__ import annotations

import argparse


def add_verbosity(command: argparse.ArgumentParser, *, quiet: str = "", verbose: str = "") -> None:
    """Add -q and -v to a command, each with its help; an empty help omits the option."""
    group = command.add_mutually_exclusive_group()
    for name, help_text in (("quiet", quiet), ("verbose", verbose)):
        if help_text:
            group.add_argument(f"-{name[0]}", f"--{name}", action="store_true", help=help_text)
