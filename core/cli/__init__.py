"""The command line. A command is a data class whose fields are its options, with `answer`, which is
the function in Python, and `run`, which prints, writes and returns the exit status.

A new command is such a class and its name in `COMMANDS`. Slow imports wait until it runs.
"""

COMMANDS = {
    "run": "run:Run",
    "sweep": "sweep:Sweep",
    "list": "list:List",
    "templates": "templates:PrintTemplates",
    "schema": "schema:PrintSchema",
    "bench": "bench:BenchAll",
    "check-joint": "check_joint:CheckJoint",
    "check-engine": "check_engine:CheckEngine",
    "import": "import_:Import",
    "export": "export:Export",
    "reference": "reference:ProveReferences",
    "explain": "explain:Explain",
    "assemblies": "assemblies:ListAssemblies",
    "same": "same:Same",
    "compare": "compare:Compare",
    "trace": "trace:Trace",
    "kc": "kc",
    "serve": "serve",
    "free": "free:MoveFreely",
    "board": "board",
    "doctor": "doctor:Doctor",
    "history": "history:ListRuns",
    "report": "report:ReportChanges",
    "stress": "stress:StressEngines",
    "completion": "completion:Completion",
}
"""Module and class of each command, in the order of the help."""
