"""Docstrings in plain English: few sentences around "what", "that" and "where"."""

import ast
import re
from collections import Counter

import pytest

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


CHAINED = re.compile(r"; ?[\w{\"'-]")
"""A clause that a message chains to another."""
MOST_CHAINED = {
    "core/extensions/hardpoints": 6,
    "core/extensions/recorded": 0,
    "core/history": 2,
    "core/extensions/compliance": 0,
    "core/case": 145,
    "core/extensions/trees": 134,
}
"""Texts with chained clauses, helps and remarks among them; a number here only falls."""


def chained(folder):
    """The texts of a folder that chain clauses, but for docstrings."""
    found = []
    for path in SOURCES:
        if folder not in map(str, path.parents):
            continue
        for node in ast.walk(tree(path)):
            for child in ast.iter_child_nodes(node):
                if isinstance(node, ast.Expr | ast.JoinedStr) or not is_text(child):
                    continue
                text = words_of(child)
                if CHAINED.search(text) and len(text.split()) > 3:
                    found.append(text)
    return found


def is_text(node):
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def words_of(node):
    parts = node.values if isinstance(node, ast.JoinedStr) else [node]
    return "".join(each.value if isinstance(each, ast.Constant) else "{}" for each in parts)


@pytest.mark.parametrize("folder", MOST_CHAINED)
def test_messages_are_short_sentences(folder):
    assert len(chained(folder)) <= MOST_CHAINED[folder], chained(folder)


def test_chained_clauses_are_counted():
    (node,) = ast.parse('f"found {x}, expected two numbers; write them"').body
    assert CHAINED.search(words_of(node.value))
