"""The command line: one module per command, with `add` (its options) and a function from the
options to an exit status.

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
    "import_",
    "export",
    "reference",
    "explain",
    "assemblies",
    "same",
    "compare",
    "trace",
    "kc",
    "serve",
    "free",
    "board",
    "doctor",
    "history",
    "report",
    "stress",
    "completion",
)
"""Modules of the commands, in the order of the help; see `command_name`."""


def command_name(module: str) -> str:
    """Return the name of a command on the command line: check-joint, import."""
    return module.rstrip("_").replace("_", "-")
