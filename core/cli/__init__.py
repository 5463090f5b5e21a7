"""Commands: a file each, with `add` (its options, on the parser) and what it does, from the options
to an exit status.

A new command is one such file and its name in `COMMANDS`. What is slow to import is imported when
the command is carried out.
"""

COMMANDS = (
    "run",
    "sweep",
    "list",
    "bench",
    "check_joint",
    "export",
    "reference",
    "explain",
    "assemblies",
    "trace",
    "doctor",
    "history",
    "report",
    "stress",
)
"""Modules of this room, in the order of the help."""
