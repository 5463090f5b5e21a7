"""Stress, benchmarks and the measured claims of the paper."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=[
        "compliance",
        "designs",
        "hardpoints",
        "live",
        "llvm",
        "proofs",
        "reports",
        "statics",
        "sweep",
    ],
    commands={"bench": "command:BenchAll", "stress": "command:StressEngines"},
    sources={"bench": "source:BenchOfRun"},
    styles={
        "paper": "paper.rows:paper",
        "conventional": "paper.rows:conventional",
        "relative": "paper.relative:relative",
    },
    completions={"family": "stress.families:FAMILIES"},
)
