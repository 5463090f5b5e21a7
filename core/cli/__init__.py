"""The command line. A command is a data class whose fields are its options, with `answer`, which is
the function in Python, and `run`, which prints, writes and returns the exit status.

A command of the kernel is such a class and its name here; a command of an extension stands in its
`EXTENSION`. Slow imports wait until it runs.
"""

from collections.abc import Mapping

from ..doors import Extension, Offer, offers

COMMANDS = {
    "run": "run:Run",
    "list": "lists:List",
    "import": "importing:Import",
    "check-joint": "checks:CheckJoint",
    "history": "history:ListRuns",
    "report": "history:ReportChanges",
    "schema": "lists:PrintSchema",
    "completion": "lists:Completion",
}
"""Module and class of each command of the kernel, in the order of the help."""


def every_command() -> Mapping[str, Offer]:
    """Return all commands by name: those of the kernel, then those of extensions."""
    own = Extension(__name__)
    return {name: Offer(own, where) for name, where in COMMANDS.items()} | offers("commands")
