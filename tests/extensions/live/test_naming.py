"""The page that names unnamed points: roles proposed by geometry, saved as a file of names."""

import json

import kincheck
import pytest
from kincheck import KincheckError
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import registry
from kincheck.core.extensions.live.command import Serve
from kincheck.core.extensions.live.naming import naming_of
from kincheck.core.extensions.live.server import LiveServer

from ...support.case_texts import write
from ...support.examples import examples
from ..hardpoints.test_guess import RACE, places, plain, rows
from .conftest import ASKED, TOLD, page_of

(IMPOSSIBLE,) = examples(__file__, "impossible")

TEXT = "name;x;y;z\n" + rows("numbers", "P{};{};{};{}")
TRUE = {role: f"P{k}" for k, role in enumerate(RACE, 1)}


@pytest.fixture
def server(tmp_path):
    file = write(tmp_path, TEXT, "car.csv")
    read = Serve(file)._reader(registry(), named=True)
    made = LiveServer(file, read, [], None)
    yield made
    made.close()


def ask(socket, **message):
    """Return the answer to a message, or the first message of a page without one."""
    if message:
        ASKED.validate(message)
        socket.send(json.dumps(message))
    told = json.loads(socket.recv(timeout=60))
    TOLD.validate(told)
    return told


def test_page_proposes_roles_and_saves(server, tmp_path, capsys):
    with page_of(server) as socket:
        found = ask(socket)
        assert {each["name"]: each["point"] for each in found["roles"] if each["point"]} == TRUE
        at = next(each["at"] for each in found["points"] if each["name"] == "P9")
        assert at == pytest.approx([1e-3 * x for x in RACE["wheel_center"]])
        names = tmp_path / "car_names.toml"
        assert ask(socket, type="names", roles=TRUE)["name"] == str(names)
    assert "car_names.toml is written. Next time, add: " in capsys.readouterr().err
    said = Supplied("double_wishbone", "mm", "iso", names=names)
    assert places(load(tmp_path / "car.csv", said)) == places(plain(tmp_path, RACE))


def test_python_asks_for_names(tmp_path):
    with pytest.raises(KincheckError, match="leaves open what options state"):
        kincheck.live(write(tmp_path, TEXT, "car.csv"))


@pytest.mark.parametrize(("changed", "message"), IMPOSSIBLE)
def test_answers_that_cannot_be(server, tmp_path, changed, message):
    with page_of(server) as socket:
        ask(socket)
        assert message in ask(socket, type="names", roles=TRUE | changed)["message"]
    assert not (tmp_path / "car_names.toml").exists()


def test_page_goes_on_when_named(server, browser):
    browser.visit(server.address)
    browser.click("#save")
    browser.until("window.kincheckLive && kincheckLive.answer")
    assert browser.run("return kincheckLive.rows().length") == len(RACE)
    assert browser.complaints() == []


def test_page_of_names_checks_nothing(server):
    with page_of(server) as socket:
        ask(socket)
        told = ask(socket, type="check", engines=["native"])["message"]
    assert told == "a table without roles has no answer to 'check'"


def test_named_table_needs_no_page(tmp_path):
    file = write(tmp_path, "name;x;y;z\n" + rows("German"), "car.csv")
    assert naming_of(file, Supplied()) is None
