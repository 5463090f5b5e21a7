"""Docstrings in plain English: few sentences around "what", "that" and "where"."""

import ast
import re
from collections import Counter

from .support.sources import SOURCES, statements, tree

MOST = 12.0
"""In 1,000 words of docstrings; asv, QCEngine, Optimistix and scikit-fem have 4 to 10."""
FEW = 1000
"""Words of a folder whose share says something."""
HEAVY = re.compile(r"\b(what|that|where)\b", re.IGNORECASE)
WORD = re.compile(r"[A-Za-z]+")

DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def shares():
    """Occurrences in 1,000 words, by folder; FOLDER/*.py is without the folders in it."""
    words, heavy = Counter(), Counter()
    for path in SOURCES:
        for node in (tree(path), *statements(tree(path))):
            text = ast.get_docstring(node) if isinstance(node, DOCUMENTED) else None
            for folder in {*map(str, path.parents), f"{path.parent}/*.py"} if text else ():
                words[folder] += len(WORD.findall(text))
                heavy[folder] += len(HEAVY.findall(text))
    return {
        folder: 1000.0 * heavy[folder] / count for folder, count in words.items() if count > FEW
    }


def test_heavy_words_are_counted():
    assert HEAVY.findall("What is told of that, where it is; whatever") == ["What", "that", "where"]


def test_docstrings_are_plain():
    assert {folder: share for folder, share in shares().items() if share > MOST} == {}
