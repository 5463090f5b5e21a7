"""Rooms stay within their budgets of tokens."""

import ast
from pathlib import Path

from .house import Size, beyond, budgets, room_of, size_of, sizes

SOURCE = '''"""Docstring."""
def first(x):
    """Docstring
    of two lines."""
    return x + 1.5  # comment
class Second:
    """Docstring."""
    async def third(self): ...
'''


def test_rooms_stay_within_their_budgets():
    allowed = budgets()
    assert [*beyond(sizes(allowed), allowed)] == []


def test_room_beyond_budget_is_named():
    found = {"core": Size(101, 1), "core/cli": Size(50, 1), "core/gone": Size()}
    messages = [*beyond(found, {"core": 100, "core/cli": 50, "core/gone": 10})]
    assert [message.split()[:3] for message in messages] == [
        ["core", "has", "101"],
        ["core/gone", "has", "no"],
    ]


def test_size_leaves_out_docstrings_and_comments():
    # def first ( x ) : return x + 1.5, class Second : async def third ( self ) : ...
    assert size_of(SOURCE, ast.parse(SOURCE)) == Size(tokens=10 + 3 + 8, files=1, functions=2)


def test_file_belongs_to_nearest_room_above():
    rooms = ["core", "core/case", "core/case/models"]
    found = [
        room_of(Path(each), rooms)
        for each in ("core/a.py", "core/case/io/a.py", "core/case/models/mjcf/x/a.py")
    ]
    assert found == rooms
