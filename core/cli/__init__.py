"""The command line. A command is a data class whose fields are its options, with `answer`, which is
the function in Python, and `run`, which prints, writes and returns the exit status.

A new command is such a class and its name in `COMMANDS`. Slow imports wait until it runs.
"""

COMMANDS = {
    "run": "run:Run",
    "sweep": "sweep:Sweep",
    "list": "lists:List",
    "templates": "files:PrintTemplates",
    "schema": "lists:PrintSchema",
    "bench": "laboratory:BenchAll",
    "check-joint": "checks:CheckJoint",
    "check-engine": "checks:CheckEngine",
    "import": "files:Import",
    "export": "files:Export",
    "reference": "checks:ProveReferences",
    "explain": "examine:Explain",
    "assemblies": "examine:ListAssemblies",
    "same": "files:Same",
    "compare": "compare:Compare",
    "trace": "examine:Trace",
    "kc": "kc:MeasureCompliance",
    "serve": "serve:Serve",
    "free": "examine:MoveFreely",
    "board": "board:CompareSteppers",
    "doctor": "doctor:Doctor",
    "history": "history:ListRuns",
    "report": "history:ReportChanges",
    "stress": "laboratory:StressEngines",
    "completion": "lists:Completion",
    "bisect": ".extensions.bisect.command:Bisect",
}
"""Module and class of each command, in the order of the help."""
