"""Docstrings in plain English: few sentences around "what", "that" and "where"."""

import ast
import re
from collections import Counter

from .test_architecture import ROOT, SOURCES

MOST = 12.0
"""In 1,000 words of docstrings; asv, QCEngine, Optimistix and scikit-fem have 4 to 10."""
HEAVY = re.compile(r"\b(what|that|where)\b", re.IGNORECASE)
WORD = re.compile(r"[A-Za-z]+")

PLAIN = (
    "adapters",
    "adapters/*.py",
    "adapters/dart",
    "adapters/drake",
    "adapters/exudyn",
    "adapters/mujoco",
    "adapters/pinocchio",
    "adapters/shared",
    "adapters/simbody",
    "adapters/writers",
    "cases",
    "core/*.py",
    "core/case",
    "core/case/io",
    "core/case/measures",
    "core/case/models/hardpoints",
    "core/case/models/hardpoints/templates",
    "core/case/variation",
    "core/cli",
    "core/harness",
    "core/harness/*.py",
    "core/history",
    "core/joints",
    "core/kincheck",
    "core/kinematics",
    "core/kinematics/assembly",
    "core/kinematics/by_components",
    "core/kinematics/compiled",
    "core/kinematics/continuation",
    "core/kinematics/diagnosis",
    "core/kinematics/forces",
    "core/kinematics/formulation",
    "core/kinematics/sparse",
    "core/kinematics/structure",
    "core/kinematics/verified",
    "core/mechanism",
    "core/primitives",
    "core/program",
    "core/report",
    "core/studies/*.py",
    "core/studies/bench",
    "core/studies/diagnosis",
    "core/studies/engine_check",
    "core/studies/joint_check",
    "core/studies/paper",
    "core/studies/stress",
    "core/studies/stress/*.py",
    "core/studies/stress/families",
    "core/studies/stress/truth",
    "core/studies/tolerance",
)
"""Folders in plain English; the others are to follow, and none may drop out."""

DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def shares():
    """Occurrences in 1,000 words, by folder; FOLDER/*.py is without the folders in it."""
    words, heavy = Counter(), Counter()
    for path in SOURCES:
        tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            text = ast.get_docstring(node) if isinstance(node, DOCUMENTED) else None
            for folder in {*map(str, path.parents), f"{path.parent}/*.py"} if text else ():
                words[folder] += len(WORD.findall(text))
                heavy[folder] += len(HEAVY.findall(text))
    return {folder: 1000.0 * heavy[folder] / words[folder] for folder in words}


def test_heavy_words_are_counted():
    assert HEAVY.findall("What is told of that, where it is; whatever") == ["What", "that", "where"]


def test_docstrings_are_plain():
    found = shares()
    assert {folder: found[folder] for folder in PLAIN if found[folder] > MOST} == {}
