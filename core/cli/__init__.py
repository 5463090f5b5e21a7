"""The command line: one module a command, with `add` (its options) and a function from the options
to an exit status.

A new command is a module and its name in `COMMANDS`. Slow imports wait until the command runs.
"""

COMMANDS = (
    "run",
    "sweep",
    "list",
    "templates",
    "schema",
    "bench",
    "check_joint",
    "check_engine",
    "export",
    "reference",
    "explain",
    "assemblies",
    "trace",
    "doctor",
    "history",
    "report",
    "stress",
    "completion",
)
"""Modules of the commands, in the order of the help."""
