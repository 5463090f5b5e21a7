"""Doors: extensions of folders and of other packages, what they need and what they offer."""

import sys
from importlib.metadata import EntryPoint

import kincheck
import pytest
from kincheck.core import KincheckError, doors
from kincheck.core.cli.main import every_command, main
from kincheck.core.kinematics import NativeSolver

from .docs.page import blocks
from .support.sources import EXTENSIONS, ROOT

PAGE = ROOT / "docs/pages/how-to/own-extension.md"


@pytest.fixture
def fresh():
    """Extensions and entry points are read again, before and after the test."""
    kincheck.load("rssr")  # which tables a case has is kept: those of all extensions
    for each in (doors.extensions, doors.entry_points):
        each.cache_clear()
    yield
    for each in (doors.extensions, doors.entry_points):
        each.cache_clear()


@pytest.fixture
def found(fresh, monkeypatch):
    """Call to have these extensions of folders, and others installed."""

    def only(*of_folders, **installed):
        points = {name: EntryPoint(name, value, doors.GROUP) for name, value in installed.items()}
        monkeypatch.setattr(doors, "_of_folders", lambda: of_folders)
        monkeypatch.setattr(doors, "entry_points", lambda group: points)

    return only


@pytest.fixture
def installed(found, tmp_path, monkeypatch):
    """The package of the page, as its pyproject.toml installs it."""
    for block in blocks(PAGE.read_text("utf-8")):
        if block.title:
            file = tmp_path / block.title
            file.parent.mkdir(exist_ok=True)
            file.write_text(block.text, "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    found(bodies="kincheck_bodies:EXTENSION")
    yield
    for name in [name for name in sys.modules if name.startswith("kincheck_bodies")]:
        del sys.modules[name]


def test_extension_of_page_adds_command(installed, capsys):
    assert main(["bodies", "rssr"]) == 0
    assert capsys.readouterr().out == "crank moves\nrocker moves\n"


def test_public_command_without_answer_is_named(installed, monkeypatch):
    extension = doors.extensions()["bodies"]
    monkeypatch.setitem(extension.offers, "public", {"bodies": "command:ListBodies"})
    with pytest.raises(TypeError, match=r"kincheck\.bodies: ListBodies has no method answer"):
        getattr(kincheck, "bodies")  # noqa: B009  unknown to those who read types


def test_method_of_extension_by_name(found, monkeypatch):
    case = kincheck.load("four_bar")
    found(doors.Extension("x.mine", methods={"by hand": "mine:by_hand"}))
    made = []

    def by_hand(mechanism, request):
        made.append(mechanism)
        return lambda path: lambda tolerance: "solved"

    monkeypatch.setattr(doors.Offer, "load", lambda self: by_hand)
    solve = NativeSolver(method="by hand").prepare(case.mechanism, case.sweep.path)
    assert (made, solve(1e-12)) == ([case.mechanism], "solved")
    with pytest.raises(
        KincheckError, match=r"method 'other'\. Give one of by hand, by size, one program"
    ):
        NativeSolver(method="other").prepare(case.mechanism, case.sweep.path)


def test_every_folder_is_an_extension():
    assert {each.name for each in EXTENSIONS} == {*doors.extensions()}


def test_every_offer_can_be_loaded():
    offered = {kind: doors.offers(kind) for kind in doors.Doors.__annotations__}
    del offered["formats"]
    assert {*offered["commands"]} <= {*every_command()}
    assert all(each.load() is not None for kind in offered.values() for each in kind.values())


def test_extension_without_its_needs_is_absent(found):
    """Also one that needs it over another."""
    chain = [("a", ["gone"]), ("b", ["a"]), ("c", [])]
    found(*(doors.Extension(f"x.{name}", needs=needs) for name, needs in chain))
    assert [*doors.extensions()] == ["c"]


def test_two_extensions_of_one_name(found):
    found(doors.Extension("x.a"), a="x:EXTENSION")
    with pytest.raises(KincheckError, match=r"Two extensions are named 'a'\. Rename"):
        doors.extensions()


def test_two_offers_of_one_name(found):
    found(*(doors.Extension(f"x.{name}", commands={"move": "a:A"}) for name in "ab"))
    with pytest.raises(KincheckError, match="a and b both offer 'move' under commands"):
        doors.offers("commands")
